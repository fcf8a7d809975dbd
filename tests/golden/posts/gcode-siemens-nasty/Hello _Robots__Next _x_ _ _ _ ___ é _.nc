; Hello "Robots" Next x ' ]]> e ?
; Hello "Robots" Next x ' ]]> e ?
; ]0x bell
; - msg,active
; not a safety function: verify at reduced speed
; Siemens 840D TRAORI: A3 B3 C3 points from the tip to the holder
; units mm, dwell in seconds
; coordinates in the scan frame: the active work offset must hold it
G710 G90 G94 G17 G40
TRAFOOF
T1 M6
; Hello "Robots" Next x ' ]]> e ?
TRAORI
G0 X0.0000 Y0.0000 Z5.0000 A3=0.287348 B3=0.000000 C3=0.957826
; Hello "Robots" Next x ' ]]> e ?
M0
G1 X10.0000 Y0.0000 Z5.0000 A3=0.155255 B3=0.241795 C3=0.957826 F600
TRAFOOF
M30
