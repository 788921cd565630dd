"""Table [process] of a slot in titanium at 3000 1/min, for cases that chatter when they are deep."""

PROCESS = """
[process]
model             = "milling-force"
cutter_diameter_m = 0.016
teeth             = 2
helix_deg         = 30.0
spindle_speed_rpm = 3000.0
engagement        = "slot"
K_tc_Pa           = 1.9e9
K_rc_Pa           = 6.0e8
K_ac_Pa           = 3.0e8
K_te_N_m          = 2.4e4
K_re_N_m          = 4.3e4
K_ae_N_m          = 7.0e2
"""
