/PROG  LIFT
/ATTR
COMMENT = "off the part";
DEFAULT_GROUP = 1,*,*,*,*;
/MN
: L P[1] 300inch/min FINE ;
: L P[2] 200mm/sec FINE ;
/POS
P[1]{
   GP1:
    UF : 2, UT : 3,        CONFIG : 'N U T, 0, 0, 0',
   X  =  130.000  mm,   Y  =  50.000  mm,   Z  =  50.000  mm,
   W  =  0.000 deg,   P  =  90.000 deg,   R  =  0.000 deg
};
P[2]{
   GP1:
    UF : 2, UT : 3,        CONFIG : 'N U T, 0, 0, 0',
   X  =  130.000  mm,   Y  =  50.000  mm,   Z  =  80.000  mm,
   W  =  0.000 deg,   P  =  90.000 deg,   R  =  0.000 deg
};
/END
