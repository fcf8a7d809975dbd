%
(porthole)
(corrected by sicp_cam)
(gates: all passed)
(not a safety function: verify at reduced speed)
(Fanuc G43.4 type 1: rotary words AC, head-head)
(units mm, dwell in seconds)
(coordinates in the scan frame: the active work offset must hold it)
N10 G21 G90 G94 G17 G40
N20 G49
N30 T3 M6
(LOADTL/3)
N40 G43.4 H3
N50 S12000 M3
N60 G0 X100.0000 Y0.0000 Z5.0000 A16.6992 C90.0000
N70 M8
N80 G1 X98.0067 Y19.8669 Z5.0286 A16.6992 C101.4592 F2000.
(first side)
N90 G1 X92.1061 Y38.9418 Z5.0571 A16.6992 C112.9183
N100 G4 X1.500
N110 G1 X82.5336 Y56.4642 Z5.0857 A16.6992 C124.3775 F900.
N120 M0
N130 G1 X69.6707 Y71.7356 Z5.1143 A16.6992 C135.8366
N140 G0 X54.0302 Y84.1471 Z5.1429 A16.6992 C147.2958
N150 M9
N160 M5
N170 G49
N180 M30
%
