"""RAPID as others write it: what may change the path and is not known is refused by its name."""

import pytest
from rapid_programs import HELD, TRAPS, to, way

from coupling.errors import ProgramError

# What stands between p1 and p3, and what the message says.
REFUSED = {
    "procedure that is missing": (
        "Detour;",
        "procedure of the program, got Detour: put its module",
    ),
    "function that is missing": (
        to("Detour(p2)"),
        "function of RAPID or of the program, got Detour",
    ),
    "arc with a signal": ("MoveCDO p2,p3,v50,z1,tq,do1,1;", "got MoveCDO, an arc"),
    "turn on an arc": ("CirPathMode\\ObjectFrame; MoveC p2,p1,v50,z1,tq;", "got .Objectframe"),
    "search": ("SearchL di1,p2,p3,v50,tq;", "got SearchL, a motion that ends where a signal comes"),
    "correction": ("MoveL p2,v50,z1,tq\\WObj:=wq\\Corr;", "MoveL without \\\\Corr"),
    "unknown option": ("MoveL p2,v50\\Wobble:=2,z1,tq\\WObj:=wq;", "MoveL without \\\\Wobble"),
    "external axes moving": (
        f"p2.extax.eax_b := 5; {to('p2')} p2.extax.eax_b := 9; {to('p2')}",
        "eax_b",
    ),
    "external axis given on the way": (
        f"p2.extax.eax_b := 5; {to('p2')}",
        "eax_b from the first target",
    ),
    "external motion": ("MoveExtJ j,v50,fine;", "got MoveExtJ"),
    "external offsets": ("EOffsSet [10,0,0,0,0,0];", "got EOffsSet"),
    **{
        f"process of {word}": (
            f"{word} p2,v50,a,b,fine,tq\\WObj:=wq;",
            f"got {word}, a motion with",
        )
        for word in ("ArcL", "ArcLStart", "ArcLEnd", "SpotL", "PaintL", "DispL", "TriggLIOs")
    },
    "number of a procedure": ('CallByVar "p",1;', "got CallByVar, the number of a procedure"),
    "function that is not computed": (to("Offs(p2,MaxRobSpeed(),0,0)"), "got MaxRobSpeed, which"),
    "part by reference": ("Change p2.trans.x;", "whole data for x of Change, which may"),
    "where the robot is": (
        f"p2 := CRobT(\\Tool:=tq); {to('p2')}",
        "got CRobT, which the controller",
    ),
    "part of where it is": ("p2.trans := CPos();" + to("p2"), "expected position, got CPos"),
    "displacement from here": ("PDispOn p1,tq;", "got PDispOn, a displacement"),
    "unknown condition": (f"IF di1 = 1 {to('p2')}", "for MoveL in line 12, got IF with 'di1'"),
    "unknown data later": (
        f"IF di1=1 p2 := p3; {to('p2')}",
        "robtarget with a value, got what depends",
    ),
    "read number": (
        f'VAR num n; TPReadNum n,"?"; {to("Offs(p2,n,0,0)")}',
        "got what TPReadNum returns",
    ),
    "flag of a wait": (
        f"VAR bool late; WaitDI di1,1\\TimeFlag:=late; IF late {to('p2')}",
        "got IF with what WaitDI returns in line 12",
    ),
    "text as a number": (
        f'VAR num n; VAR bool ok; ok := StrToVal("3",n); {to("Offs(p2,n,0,0)")}',
        "got what StrToVal returns in line 12",
    ),
    "open flag of a wait": (
        f"VAR bool late; IF di1=1 WaitDI di2,1\\TimeFlag:=late; IF late {to('p2')}",
        "got IF with what depends on 'di1'",
    ),
    "unknown bound": (f"FOR i FROM 1 TO n0 DO {to('p2')} ENDFOR", "got FOR with 'n0'"),
    "unknown case": (f"TEST di1 CASE 1: {to('p2')} ENDTEST", "got TEST with 'di1'"),
    "unknown loop": (f"WHILE di1 = 0 DO {to('p2')} ENDWHILE", "got WHILE with 'di1'"),
    "return behind it": ("IF di1 = 1 RETURN;", "for RETURN in line 12"),
    "endless": ("WHILE 1=1 DO p2.trans.x:=1; ENDWHILE", "a loop that does not end"),
    "endless count": ("VAR num k; WHILE k < 1 DO k := k*1; ENDWHILE", "at most 100000 repeated"),
    "huge count": ("FOR i FROM 1 TO 1E7 DO ENDFOR", "a loop that does not end"),
    "recursion": ("main;", "at most 25 routines"),
    "jump": ("GOTO a; a:", "got GOTO"),
    "raise": ("RAISE;", "got RAISE"),
    "held part": (
        to("p2", 'tq\\WObj:=[TRUE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]]'),
        "robhold FALSE, got TRUE",
    ),
    "work object that moves": (
        to("p2", 'tq\\WObj:=[FALSE,FALSE,"STN1",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]]'),
        'stands still, ufprog TRUE, got FALSE, moved by "STN1"',
    ),
    "stationary tool": (f"tq.robhold := FALSE; {to('p2')}", "robhold TRUE, got FALSE: stationary"),
    "frame that is held": (to("p2", "tq\\WObj:=wHeld"), "does not say where wHeld is"),
    "frame set in part": (
        f"wHeld.uframe.trans.x := 3; {to('p2', HELD)}",
        "'wHeld', of which a part is set in line 12",
    ),
    "override on the way": ("SpeedRefresh 50;", "got SpeedRefresh, a change"),
    "no speed": (to("p2", speed="[0,500,5000,1000]"), "a speed > 0, got 0"),
    "both": (to("p2", speed="v50\\V:=3\\T:=2"), "got both"),
    "soft servo": ("SoftAct 1,50;", "got SoftAct"),
    "conveyor": ("WaitWObj wCnv;", "got WaitWObj"),
    "unknown instruction": ("Wobble 3;", "got Wobble"),
    "interrupt that moves": ("CONNECT i1 WITH tMove;", "got tMove with MoveL in line"),
    "interrupted data": (
        f"CONNECT i1 WITH tSet; p2 := p1; {to('p2')}",
        "got what trap tSet changes",
    ),
    "synchronised procedure": ('MoveLSync p2,v50,z1,tq\\WObj:=wq,"Move2";', "got MoveLSync"),
    "star": (to("*"), r"robtarget with a value, got '\*'"),
    "division": ("VAR num k := 1/0;", "expected a divisor other than 0, got 0"),
    "root": ("VAR num k := Sqrt(-1);", "arguments of Sqrt, got -1"),
    "index": ("VAR num a{2}; a{3} := 1;", "an index from 1 to 2, got 3"),
    "component": ("p2.trans.w := 1;", "a component of pos, got 'w'"),
    "constant": ("p1.trans.x := 1;", "data that are no constant, got 'p1'"),
    "kind": ("p2 := 3;", "a value of robtarget, got one of num"),
    "uninitialised": (f"VAR robtarget q; {to('q')}", "a quaternion of length 1, got length 0"),
    "huge array": ("VAR robtarget q{1000,1000};", "at most 20000 elements"),
    "huge text": (
        'VAR string s := "a"; FOR i FROM 1 TO 99 DO s := s+s; ENDFOR',
        "a text of at most",
    ),
    "brackets": (f"VAR num k := {'(' * 9000}1{')' * 9000};", "at most 40 brackets"),
    "statements": ("IF TRUE THEN " * 99 + "ENDIF " * 99, "at most 30 statements"),
    "arguments": ("MoveL p2,v50,tq;", "expected 4 arguments of MoveL"),
    "module": ('Load \\Dynamic, "HOME:a.mod";', "got Load, a module that it loads"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_may_change_the_path_is_refused_by_its_name(name):
    second, said = REFUSED[name]
    with pytest.raises(ProgramError, match=said) as raised:
        way(second, routines=TRAPS)
    message = str(raised.value)
    assert message.startswith("way.mod: line ")
    assert "\n" not in message
    assert len(message) < 300
