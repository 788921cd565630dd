/* Random calls of FMI 2.0 in any order: fuzz2 LIBRARY GUID RESOURCES-URI CALLS. */
#include "draw.h"
#include "master.h"

/* A spring as it may be; its entries are the variables behind the first. */
static void set_spring(fmi2Component c)
{
    fmi2ValueReference references[6];
    double entries[6];
    draw_stiffness(entries);
    for (unsigned k = 0; k < 6; k++)
        references[k] = named("anchor.kxx")->reference + k;
    ffmi2SetReal(c, references, 6, entries);
}

/* Random calls with random arguments, in any order: a status each time, and finite outputs. */
static void make_calls(long calls)
{
    fmi2Component c = new_instance();
    fmi2FMUstate state = NULL;
    double time = 0.0;
    for (long call = 0; call < calls; call++) {
        fmi2ValueReference references[8], inputs[4];
        double values[8], seeds[4];
        unsigned count = draw(8) + 1;
        for (unsigned i = 0; i < count; i++) {
            references[i] = draw(20) == 0 ? draw(200) : draw_variable(NULL, false)->reference;
            values[i] = draw_value();
        }
        for (unsigned i = 0; i < 4; i++) {
            inputs[i] = draw_variable(draw(20) == 0 ? NULL : "input", false)->reference;
            seeds[i] = draw_value();
        }
        switch (draw(40)) {
        case 22:
            if (draw(20) == 0)
                ffmi2Terminate(c);
            break;
        case 0: ffmi2SetReal(c, references, count, values); break;
        case 1: case 2: case 3: ffmi2SetReal(c, inputs, 1, seeds); break;
        case 4: case 5: case 6:
            if (ffmi2GetReal(c, references, count, values) == fmi2OK)
                for (unsigned i = 0; i < count; i++)
                    CHECK(isfinite(values[i]));
            break;
        case 7: {
            fmi2ValueReference reference = draw_variable(NULL, draw(3) > 0)->reference;
            const char *text = draw_text();
            ffmi2SetString(c, &reference, 1, &text);
            ffmi2GetString(c, &reference, 1, &text);
            break;
        }
        case 8: ffmi2SetupExperiment(c, draw(2), draw_value(), time = draw_value(), 0, 0.0); break;
        case 9: case 10: ffmi2EnterInitializationMode(c); break;
        case 11: case 12: ffmi2ExitInitializationMode(c); break;
        case 13: ffmi2GetFMUstate(c, &state); break;
        case 14: ffmi2SetFMUstate(c, state); break;
        case 15:
            if (draw(8) == 0) {
                ffmi2Reset(c);
                time = 0.0;
            }
            break;
        case 16: {
            static unsigned char bytes[100000];
            size_t size = 0;
            if (state != NULL && ffmi2SerializedFMUstateSize(c, state, &size) == fmi2OK) {
                CHECK(size <= sizeof bytes);
                ffmi2SerializeFMUstate(c, state, (fmi2Byte *)bytes, size);
                if (draw(2))
                    bytes[draw((unsigned)size)] ^= (unsigned char)draw(256);
                ffmi2DeSerializeFMUstate(c, (fmi2Byte *)bytes, size - draw(2), &state);
            }
            break;
        }
        case 17:
            ffmi2GetDirectionalDerivative(c, references, count, inputs, 2, seeds, values);
            break;
        case 18: ffmi2FreeFMUstate(c, &state); break;
        case 23: case 24: case 25: set_spring(c); break;
        case 19: ffmi2GetInteger(c, references, draw(2), NULL); break;
        case 20: ffmi2SetBoolean(c, references, draw(2), NULL); break;
        case 21:
            if (draw(50) == 0) {
                ffmi2FreeInstance(c);
                c = new_instance();
                ffmi2FreeFMUstate(c, &state);
                time = 0.0;
            }
            break;
        default: {
            double size = draw_step();
            if (ffmi2DoStep(c, time, size, fmi2True) == fmi2OK)
                time += size;
        }
        }
    }
    ffmi2FreeFMUstate(c, &state);
    ffmi2FreeInstance(c);
    printf("%ld calls, %ld messages\n", calls, messages);
}

int main(int count, char **arguments)
{
    start_master(count, arguments);
    make_calls(atol(arguments[4]));
    return 0;
}
