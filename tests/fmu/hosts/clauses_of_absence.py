"""Clauses of both standards on what an FMU does not have, and on what it tells of itself."""

from ctypes import byref, c_bool, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p

from standard import DISCARD, ERROR, OK

SIZES = ("8", "16", "32", "64")
NUMBERS = [f"{sign}Int{size}" for sign in ("", "U") for size in SIZES] + ["Float32", "Boolean"]
SPARE = 64  # bytes of a result that nothing may be written to


def versions(fmu):
    """FMI 2, 2.1.4: fmi2GetTypesPlatform "default", fmi2GetVersion "2.0"; FMI 3, 2.2.5: "3.0"."""
    told = {"GetVersion": b"2.0" if fmu.version == "2" else b"3.0"}
    if fmu.version == "2":
        told["GetTypesPlatform"] = b"default"
    for name, text in told.items():
        function = getattr(fmu.library, f"fmi{fmu.version}{name}")
        function.restype = c_char_p
        assert function() == text


def absent_variables(fmu):
    """FMI 2, 2.1.7, FMI 3, 2.2.7.2: functions by type are there whatever types the FMU has; FMI 3,
    2.2.4: "illegal arguments" are Error."""
    i = fmu.instance(logging=True).start()
    before = i.bytes()
    kinds = ("Integer", "Boolean") if fmu.version == "2" else (*NUMBERS, "Binary", "Clock")
    for kind in kinds:
        counts = int(fmu.version == "3" and kind != "Clock")
        sizes = [(c_size_t * SPARE)()] if kind == "Binary" else []
        for verb in ("Get", "Set"):
            values = (c_double * SPARE)()
            for names, status in ((["force.x"], ERROR), ([], OK)):
                i.log.clear()
                given = [*i.vrs(names), *sizes, values, *[c_size_t(len(names))] * counts]
                assert i.call(verb + kind, *given) == status, (verb, kind, names)
                assert len(i.log) == (status == ERROR), (verb, kind, i.log)
            assert not any(values)
    assert i.bytes() == before


def absent_clocks(fmu):
    """FMI 3, 2.2.8.4, 5.2.1: intervals, shifts and partitions are those of variables that are clocks."""
    if fmu.version == "2":
        return
    i = fmu.instance(logging=True).start()
    before = i.bytes()
    for name in ("IntervalDecimal", "IntervalFraction", "ShiftDecimal", "ShiftFraction"):
        for verb in ("Get", "Set"):
            results = [(c_double * SPARE)() for _ in range(3)]
            i.log.clear()
            assert i.call(f"{verb}{name}", *i.vrs(["force.x"]), *results) == ERROR, (verb, name)
            assert b"no clocks" in i.log[0][-1]
            assert not any(any(own) for own in results)
    assert i.call("ActivateModelPartition", c_uint(0), c_double(0.0)) == ERROR
    assert i.bytes() == before


def absent_modes(fmu):
    """FMI 3, 2.3.5: with providesEvaluateDiscreteStates and hasEventMode; 2.3.6: with structural
    parameters; 2.2.9: with providesPerElementDependencies; 2.3.1: with ScheduledExecution."""
    if fmu.version == "2":
        return
    i = fmu.instance(logging=True).start()
    before = i.bytes()
    names = ["EnterConfigurationMode", "ExitConfigurationMode", "EvaluateDiscreteStates"]
    for name in [*names, *["EnterStepMode"] * (fmu.use == "cs")]:
        i.log.clear()
        assert i.call(name) == ERROR, name
        assert len(i.log[0][-1]) > 20
    count, tcp = c_size_t(7), c_uint(fmu.reference["tcp.x"])
    assert i.call("GetNumberOfVariableDependencies", tcp, byref(count)) == ERROR
    assert count.value == 7
    results = [(c_size_t * SPARE)() for _ in range(4)]
    assert i.call("GetVariableDependencies", tcp, *results, c_size_t(1)) == ERROR
    assert not any(any(own) for own in results)
    assert i.bytes() == before
    make, told = fmu.library.fmi3InstantiateScheduledExecution, len(i.log)
    make.restype = c_void_p
    token, flags = fmu.description.guid.encode(), (c_bool(False), c_bool(False))
    folder = f"{fmu.folder / 'resources'}/".encode()
    made = make(b"robot", token, folder, *flags, None, i._logger, None, None, None)
    assert made is None
    assert b"scheduled execution" in i.log[told][-1]


def absent_results(fmu):
    """FMI 2, 4.2.1: derivatives of outputs up to maxOutputDerivativeOrder; 4.2.2: fmi2CancelStep ends
    what is pending; 4.2.3: a status that is not there is Discard."""
    if fmu.version == "3" or fmu.use == "me":
        return
    i = fmu.instance().start()
    assert i.step(0.0, 0.01)[0] == OK
    before, value = i.bytes(), (c_double * 1)(7.0)
    assert i.call("GetRealOutputDerivatives", *i.vrs(["tcp.x"]), (c_int * 1)(1), value) == ERROR
    assert list(value) == [7.0]
    assert i.call("CancelStep") == ERROR
    for kind, result in (("Integer", c_int(7)), ("String", c_char_p(b"7"))):
        kept = result.value
        for asked in range(4):
            assert i.call(f"Get{kind}Status", asked, byref(result)) == DISCARD
        assert result.value == kept
    assert i.bytes() == before


def debug_lists(fmu):
    """FMI 2, 2.1.5: "If loggingOn = fmi2True, debug logging is enabled, otherwise it is switched off",
    with a list for the listed categories only; FMI 3, 2.3.1: off with a list turns that list off."""

    def heard():
        i.log.clear()
        assert i.set_string("mode", "statick") == DISCARD
        assert i.set({"tcp.x": 1.0}) == ERROR
        return [entry[1].decode() for entry in i.log]

    def turned(on, *names):
        flag = c_int(on) if fmu.version == "2" else c_bool(on)
        listed = (c_char_p * max(len(names), 1))(*[name.encode() for name in names])
        return i.call("SetDebugLogging", flag, c_size_t(len(names)), listed)

    both = ["logStatusDiscard", "logStatusError"]
    i = fmu.instance(logging=True)
    assert heard() == both
    assert turned(False) == OK
    assert heard() == []
    assert turned(True, "logStatusError") == OK
    assert heard() == ["logStatusError"]
    assert turned(True) == OK
    assert heard() == both
    assert turned(False, "logStatusError") == OK
    assert heard() == ([] if fmu.version == "2" else ["logStatusDiscard"])
    assert turned(True, "no such category") == ERROR


def state_numbers(fmu):
    """FMI 3, 2.3.2: fmi3GetNumberOfContinuousStates and fmi3GetNumberOfEventIndicators, in model
    exchange; they are those that modelDescription.xml lists."""
    if fmu.version == "2":
        return
    i = fmu.instance()
    listed = {
        "ContinuousStates": sum(v.derivative is not None for v in fmu.description.modelVariables),
        "EventIndicators": len(fmu.description.eventIndicators),
    }
    for name, count in listed.items():
        number = c_size_t(7)
        status = i.call(f"GetNumberOf{name}", byref(number))
        assert (status, number.value) == ((ERROR, 7) if fmu.use == "cs" else (OK, count))
