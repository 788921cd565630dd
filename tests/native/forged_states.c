/* States whose bytes somebody has changed and marked as whole: forged_states LIBRARY GUID RESOURCES-URI FIRST STRIDE.
 *
 * From byte FIRST on in strides, a whole number or a byte of a state is absurd, its checksum right again.  Such a
 * state is refused, or does no harm: what is asked of it is answered or refused, and the state before goes on.
 */
#include <stdint.h>

#include "master.h"

enum { MOST = 2000 };

static uint64_t hash(const unsigned char *bytes, size_t size)
{
    uint64_t value = UINT64_C(14695981039346656037);
    for (size_t k = 0; k < size; k++)
        value = (value ^ bytes[k]) * UINT64_C(1099511628211);
    return value;
}

static void use(fmi2Component c, double time)
{
    static double values[MOST];
    for (unsigned k = 0; k < variable_count; k++) {
        const char *text = "";
        if (variables[k].is_string && ffmi2GetString(c, &variables[k].reference, 1, &text) == fmi2OK)
            CHECK(strlen(text) < 2000);
        else if (!variables[k].is_string)
            ffmi2GetReal(c, &variables[k].reference, 1, values);
    }
    ffmi2DoStep(c, time, 1e-3, fmi2True);
}

int main(int count, char **arguments)
{
    static const int absurd[] = {-2, 3, 77, 0x7fffffff, -0x7fffffff};
    fmi2Component c;
    fmi2FMUstate good = NULL, forged = NULL;
    unsigned char *bytes, *copy;
    size_t size = 0, first, stride;
    long accepted = 0, refused = 0;
    start_master(count, arguments);
    c = new_instance();
    CHECK(ffmi2SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK);
    CHECK(ffmi2EnterInitializationMode(c) == fmi2OK && ffmi2ExitInitializationMode(c) == fmi2OK);
    CHECK(ffmi2DoStep(c, 0.0, 1e-3, fmi2True) == fmi2OK);
    CHECK(ffmi2GetFMUstate(c, &good) == fmi2OK && ffmi2SerializedFMUstateSize(c, good, &size) == fmi2OK);
    bytes = malloc(size), copy = malloc(size);
    CHECK(bytes != NULL && copy != NULL && ffmi2SerializeFMUstate(c, good, (fmi2Byte *)bytes, size) == fmi2OK);
    first = strtoul(arguments[4], NULL, 10), stride = strtoul(arguments[5], NULL, 10);
    for (size_t at = first; at + 2 * sizeof(uint64_t) <= size; at += stride) {
        uint64_t checksum;
        int number = absurd[at / stride % 5];
        memcpy(copy, bytes, size);
        memcpy(copy + at, &number, at % 4 == 0 ? sizeof number : 1);
        checksum = hash(copy, size - sizeof checksum);
        memcpy(copy + size - sizeof checksum, &checksum, sizeof checksum);
        if (ffmi2DeSerializeFMUstate(c, (fmi2Byte *)copy, size, &forged) != fmi2OK) {
            refused++;
            continue;
        }
        accepted++;
        if (ffmi2SetFMUstate(c, forged) == fmi2OK)
            use(c, 1e-3);
        CHECK(ffmi2SetFMUstate(c, good) == fmi2OK);
    }
    ffmi2FreeFMUstate(c, &good);
    ffmi2FreeFMUstate(c, &forged);
    ffmi2FreeInstance(c);
    free(bytes);
    free(copy);
    printf("%ld accepted, %ld refused\n", accepted, refused);
    return 0;
}
