/* Where the resources are. */
#ifndef ER_URI_H
#define ER_URI_H

/* Path of a file in the folder that a file: URI names, to be freed; NULL if it is not such a URI. */
char *er_path_from_uri(const char *uri, const char *file);

/* The same of a folder's own path; NULL if memory is short. */
char *er_path_in_folder(const char *folder, const char *file);

#endif
