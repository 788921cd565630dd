/* What the desk library's functions are declared with. */
#ifndef ER_EXPORT_H
#define ER_EXPORT_H

#if defined(_WIN32)
#define ER_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define ER_EXPORT __attribute__((visibility("default")))
#else
#define ER_EXPORT
#endif

#endif
