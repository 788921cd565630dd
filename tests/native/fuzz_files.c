/* Damaged trajectory files: fuzz_files SEED TIMES FILE...
 *
 * Linked with the FMU's library, so that a sanitizer sees both.  Each is written beside this program, then read.
 */
#include "draw.h"

#include "../../fmu_src/native/core/load/trajectory_build.h"

typedef struct {
    unsigned char *bytes;
    size_t size;
} content;

static content read_content(const char *path)
{
    static unsigned char bytes[100000];
    content c;
    FILE *file = fopen(path, "rb");
    CHECK(file != NULL);
    c.size = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    c.bytes = malloc(c.size + 1);
    CHECK(c.bytes != NULL && c.size < sizeof bytes);
    memcpy(c.bytes, bytes, c.size);
    return c;
}

/* Replaces some bytes by others. */
static void replace(content *c, size_t from, size_t lost, const void *with, size_t length)
{
    unsigned char *bytes = malloc(c->size - lost + length + 1);
    CHECK(bytes != NULL);
    memcpy(bytes, c->bytes, from);
    memcpy(bytes + from, with, length);
    memcpy(bytes + from + length, c->bytes + from + lost, c->size - from - lost);
    free(c->bytes);
    c->bytes = bytes;
    c->size += length - lost;
}

static size_t least(size_t a, size_t b)
{
    return a < b ? a : b;
}

static void damage(content *c)
{
    static const char *const words[] = {"1e999", "nan", "-", ",", "\n", "'shape'", "(", ")", "99999999", "'<f4'",
                                        "'>U9'", "PK\1\2", "PK\5\6", "\xff\xff\xff\xff", "1e-300", "#"};
    size_t at = c->size > 0 ? draw((unsigned)c->size) : 0, left = c->size - at;
    unsigned char byte = (unsigned char)draw(256);
    const char *word = words[draw(16)];
    switch (draw(7)) {
    case 0: case 1: case 2: replace(c, at, least(1, left), &byte, 1); break;
    case 3: replace(c, at, least(draw(9), left), "", 0); break;
    case 4: replace(c, at, least(draw(9), left), word, strlen(word)); break;
    case 5: {
        unsigned char copy[40];
        size_t length = least(draw(sizeof copy), left);
        memcpy(copy, c->bytes + at, length);
        replace(c, draw((unsigned)c->size + 1), 0, copy, length);
        break;
    }
    default:
        if (draw(4) == 0)
            replace(c, at, left, "", 0);
    }
}

static unsigned number_at(const unsigned char *at, int bytes)
{
    unsigned value = 0;
    while (bytes-- > 0)
        value = value << 8 | at[bytes];
    return value;
}

static unsigned checksum_of(const unsigned char *bytes, size_t size)
{
    unsigned value = 0xffffffffu;
    for (size_t k = 0; k < size; k++) {
        value ^= bytes[k];
        for (int bit = 0; bit < 8; bit++)
            value = value >> 1 ^ (value & 1u ? 0xedb88320u : 0u);
    }
    return ~value;
}

/* Gives stored members the checksum of what they hold now, so that what reads them sees the damage. */
static void mend(content *c)
{
    for (size_t at = 0; at + 46 <= c->size; at++) {
        size_t offset, start, size;
        if (memcmp(c->bytes + at, "PK\1\2", 4) != 0)
            continue;
        size = number_at(c->bytes + at + 20, 4);
        offset = number_at(c->bytes + at + 42, 4);
        if (offset > c->size || c->size - offset < 30)
            continue;
        start = offset + 30 + number_at(c->bytes + offset + 26, 2) + number_at(c->bytes + offset + 28, 2);
        if (start <= c->size && size <= c->size - start) {
            unsigned checksum = checksum_of(c->bytes + start, size);
            for (int k = 0; k < 4; k++)
                c->bytes[at + 16 + (size_t)k] = (unsigned char)(checksum >> 8 * k);
        }
    }
}

static void write_content(const char *path, const content *c)
{
    FILE *file = fopen(path, "wb");
    CHECK(file != NULL && fwrite(c->bytes, 1, c->size, file) == c->size);
    fclose(file);
}

int main(int count, char **arguments)
{
    static const er_settings settings = {.closest_samples = 1e-6, .most_sample = 1e12};
    long times, refused = 0;
    CHECK(count >= 4);
    start_draw(count, arguments, 1);
    times = atol(arguments[2]);
    for (long k = 0; k < times; k++) {
        const char *file = arguments[3 + draw((unsigned)count - 3)];
        content c = read_content(file);
        char damaged[1000];
        er_trajectory trajectory;
        er_failure failure;
        for (unsigned more = 1 + draw(4); more > 0; more--)
            damage(&c);
        if (draw(2) == 0)
            mend(&c);
        snprintf(damaged, sizeof damaged, "%s%s", arguments[0], strstr(file, ".npz") != NULL ? ".npz" : ".csv");
        write_content(damaged, &c);
        failure.text[0] = '\0';
        if (er_trajectory_read(&trajectory, damaged, 1, &settings, &failure)) {
            size_t hint = 0;
            er_drives drives = {.trajectory = &trajectory, .hint = &hint, .joints = 1};
            double q, qd, qdd;
            er_drives_at(&drives, 0.5 * trajectory.time[trajectory.samples - 1], &q, &qd, &qdd);
            CHECK(isfinite(q) && isfinite(qd) && isfinite(qdd));
            er_trajectory_free(&trajectory);
        } else {
            CHECK(strlen(failure.text) > 10);
            refused++;
        }
        free(c.bytes);
    }
    printf("%ld times, %ld refused\n", times, refused);
    return 0;
}
