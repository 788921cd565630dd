"""Instructions of RAPID by what a reader does with them: moves, left out, writing, refused.

An instruction that stands in none of these tables is refused by its name.
"""

from __future__ import annotations

from dataclasses import dataclass

from coupling.programs.program import Motion


@dataclass(frozen=True)
class MoveForm:
    """How the arguments of a motion instruction stand.

    Attributes:
        motion: Motion to the target.
        count: Number of its arguments.
        targets: Number of them that are targets, the first ones: an arc goes through the first.
        tool: Place of the tool among them, from the end.
    """

    motion: Motion
    count: int
    tool: int = 1
    targets: int = 1


# Signal and value stand behind the tool; a trigger behind the speed.
MOVES = {
    "MOVEL": MoveForm("linear", 4),
    "MOVEC": MoveForm("linear", 5, targets=2),
    **dict.fromkeys(("MOVEJ", "MOVEABSJ"), MoveForm("joint", 4)),
    **dict.fromkeys(("MOVELDO", "MOVELAO", "MOVELGO"), MoveForm("linear", 6, tool=3)),
    **dict.fromkeys(("MOVEJDO", "MOVEJAO", "MOVEJGO"), MoveForm("joint", 6, tool=3)),
    "TRIGGL": MoveForm("linear", 5),
    **dict.fromkeys(("TRIGGJ", "TRIGGABSJ"), MoveForm("joint", 5)),
}

# Options of motions that change neither the way nor its speed.
_OPTION_WORDS = """
Conc TLoad Inpos SeamName T2 T3 T4 T5 T6 T7 T8 TriggData1 TriggData2 TriggData3 EventData
"""
LEFT_OUT_OPTIONS = {word.upper(): f"\\{word}" for word in _OPTION_WORDS.split()}

_LEFT_OUT_WORDS = """
AccSet ActEventBuffer ActUnit AliasIO AliasIOReset BookErrNo ClearIOBuff ClearRawBytes
ClkReset ClkStart ClkStop Close CloseDir ConfJ ConfL CornerPathWarning DeactEventBuffer DeactUnit
EOffsOff ErrLog ErrWrite FricIdInit GripLoad IDelete IDisable IEnable IError InvertDO IOBusStart
IODisable IOEnable IPers IRMQMessage ISignalAI ISignalAO ISignalDI ISignalDO ISignalGI ISignalGO
ISleep ITimer IWatch MakeDir MotionSup Open OpenDir PackRawBytes PathAccLim PathLengthReset
PathLengthStart PathLengthStop PathResol ProcerrRecovery PulseDO RemoveDir RemoveFile RenameFile
Reset ResetPPMoved ResetRetryCount Rewind RMQSendMessage Save SenDevice Set SetAO SetDO SetGO
SetSysData SkipWarn SocketBind SocketClose SocketConnect SocketCreate SocketListen SocketSend
SocketSendTo SoftDeact SpyStart SpyStop TPErase TPShow TPWrite TriggCheckIO TriggEquip TriggInt
TriggIO TriggRampAO TriggSpeed TriggStopProc TuneReset TuneServo UIMsgWrite UIMsgWriteAbort UIShow
WaitAI WaitAO WaitDI WaitDO WaitGI WaitGO WaitRob WaitSyncTask WaitTime WaitUntil WorldAccLim Write
WriteAnyBin WriteBin WriteCfgData WriteRawBytes WriteStrBin WriteVar WZBoxDef WZCylDef WZDisable
WZDOSet WZEnable WZFree WZHomeJointDef WZLimJointDef WZLimSup WZSphDef
"""
LEFT_OUT = {word.upper(): word for word in _LEFT_OUT_WORDS.split()}

# Those that wait for what only the controller knows; behind a zone the robot waits if it must.
SIGNAL_WAITS = frozenset(word for word in LEFT_OUT if word.startswith("WAIT")) - {
    "WAITROB",
    "WAITTIME",
}

# Left out as well, but data that are given to them are not known any more.
_WRITING_WORDS = """
CopyRawBytes FSSize GetDataVal GetSysData ReadAnyBin ReadCfgData ReadErrData ReadRawBytes ReadVarArr
RMQGetMessage RMQGetMsgData RMQGetMsgHeader RMQReadWait SocketAccept SocketReceive SocketReceiveFrom
TPReadDnum TPReadFK TPReadNum UIMsgBox UnpackRawBytes WaitTestAndSet
"""
WRITING = {word.upper(): word for word in _WRITING_WORDS.split()}

# What stops a program; others start it again, or not.
STOPS = {word.upper(): word for word in ("Stop", "Break", "EXIT", "ExitCycle", "SystemStopAction")}

_ARC = "an arc with a process or a signal: write MoveC, or its points as lines"
_SEARCH = "a motion that ends where a signal comes: write its end as a target"
_MOVING_FRAMES = "what moves with a conveyor, an external axis or another robot"
_SENSOR = "a correction while the robot moves: leave it out, the path is the programmed one"
_REFUSED_WORDS = {
    _ARC: """MoveCDO MoveCAO MoveCGO MoveCSync TriggC ArcC ArcC1 ArcC2 ArcCStart ArcCEnd
        ArcC1Start ArcC1End PaintC DispC CapC TriggCIOs""",
    _SEARCH: "SearchL SearchC SearchJ SearchExtJ ArcLSearch FCPressL",
    _MOVING_FRAMES: """MoveExtJ SyncMoveOn SyncMoveOff SyncMoveUndo WaitWObj DropWObj WaitSensor
        DropSensor SyncToSensor SupSyncSensorOn EOffsOn EOffsSet IndAMove IndRMove IndDMove IndCMove
        IndReset""",
    _SENSOR: """CorrCon CorrWrite CorrDiscon CorrClear EGMActPose EGMRunPose EGMActJoint EGMRunJoint
        EGMActMove EGMMoveL SoftAct ContactL FCAct FCDeact FCSPChgTunParam""",
    "motions that depend on a stop": """StopMove StartMove StopMoveReset StorePath RestoPath ClearPath
        PathRecStart PathRecStop PathRecMoveBwd PathRecMoveFwd StepBwdPath""",
    "a motion with a process, which are not read: write MoveL or MoveJ": """ArcL ArcLStart ArcLEnd
        CapL DispL PaintL PaintJ SpotL SpotJ TriggLIOs MoveLSync MoveJSync""",
    "a displacement that hangs on a motion: give it to PDispSet": "PDispOn",
    "a change of the speed while the robot moves: give speeds to the motions": "SpeedRefresh",
    "the number of a procedure: write its name": "CallByVar",
    "a module that it loads while it runs: put it beside the program": "Load UnLoad WaitLoad StartLoad",
}
REFUSED = {
    word.upper(): (word, reason)
    for reason, words in _REFUSED_WORDS.items()
    for word in words.split()
}
