/* Damaged robot data: fuzz_data ROBOT.TXT TIMES.
 *
 * Linked with the FMU's library, so that a sanitizer sees both.  The text has its own size and not a
 * byte more.
 */
#include "draw.h"

#include "../../fmu_src/native/fmi/interface.h"

/* Where a random line of a text begins. */
static size_t draw_line(const char *text, size_t size)
{
    size_t at = draw((unsigned)size);
    while (at > 0 && text[at - 1] != '\n')
        at--;
    return at;
}

/* One damage: a byte, a word or a line changed, doubled or lost, or the end cut off. */
static char *damaged(const char *text, size_t size)
{
    static const char *const words[] = {"1e999", "nan", "-1", "0", "end", "joint", "tilt", "spring",
                                        "reals", "string", "setting", "wrench", "", "x[1]", "stop", "motor"};
    size_t line = draw_line(text, size), end = line + strcspn(text + line, "\n");
    size_t from = line, to = line; /* replaced by `with` */
    const char *with = "";
    char *result, *copy = NULL;
    switch (draw(6)) {
    case 0: /* a line lost */
        to = end < size ? end + 1 : end;
        break;
    case 1: case 2: /* a line doubled somewhere */
        copy = calloc(end - line + 2, 1);
        CHECK(copy != NULL);
        memcpy(copy, text + line, end - line);
        copy[end - line] = '\n';
        from = to = draw_line(text, size);
        with = copy;
        break;
    case 3: /* another word */
        from += strcspn(text + line, " \n");
        to = from + (text[from] == ' ' ? 1 + strcspn(text + from + 1, " \n") : 0);
        with = words[draw(16)];
        break;
    case 4: /* the end */
        from = draw((unsigned)size);
        to = size;
        break;
    default:
        to = from + 1;
        with = words[draw(16)];
    }
    result = malloc(size - (to - from) + strlen(with) + 1);
    CHECK(result != NULL);
    memcpy(result, text, from);
    strcpy(result + from, with);
    memcpy(result + from + strlen(with), text + to, size - to + 1);
    free(copy);
    return result;
}

int main(int count, char **arguments)
{
    static char text[200000];
    static er_robot robot;
    static er_interface interface;
    long times, refused = 0;
    size_t size;
    FILE *file;
    CHECK(count == 3);
    file = fopen(arguments[1], "rb");
    CHECK(file != NULL);
    size = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    times = atol(arguments[2]);
    for (long k = 0; k < times; k++) {
        er_failure failure;
        er_lines lines;
        char *now = damaged(text, size);
        for (unsigned more = draw(30) == 0 ? 60 : draw(3); more > 0 && now[0] != '\0'; more--) {
            char *next = damaged(now, strlen(now));
            free(now);
            now = next;
        }
        failure.text[0] = '\0';
        er_lines_start(&lines, now, &failure);
        if (!er_robot_parse(&robot, &lines) || !er_interface_parse(&interface, &robot, &lines)) {
            CHECK(strlen(failure.text) > 20);
            refused++;
        }
        free(now);
    }
    printf("%ld times, %ld refused\n", times, refused);
    return 0;
}
