%
O00001
(porthole)
(corrected by sicp_cam)
(gates: all passed)
(not a safety function: verify at reduced speed)
(Haas G234: rotary words AC, head-table)
(units inch, dwell in seconds)
(coordinates in the scan frame: the active work offset must hold it)
G20 G90 G94 G17 G40
G49
T3 M6
(LOADTL/3)
G234 H3
S12000 M3
G0 X3.937008 Y0.000000 Z0.196850 A16.6992 C90.0000
M8
G1 X3.858530 Y0.782163 Z0.197975 A16.6992 C101.4592 F78.7402
(first side)
G1 X3.626224 Y1.533143 Z0.199100 A16.6992 C112.9183
G4 P1.500
G1 X3.249353 Y2.223002 Z0.200225 A16.6992 C124.3775 F35.4331
M0
G1 X2.742940 Y2.824237 Z0.201350 A16.6992 C135.8366
G0 X2.127174 Y3.312878 Z0.202475 A16.6992 C147.2958
M9
M5
G49
M30
%
