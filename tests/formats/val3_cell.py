"""A VAL3 application as the manufacturer's own tool would write one, for tests that break it in one place."""

from pathlib import Path

BOM = b"\xef\xbb\xbf"
XSI = 'xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"'
SCHEMA = "http://www.staubli.com/robotics/VAL3"

PROJECT = f"""<?xml version="1.0" encoding="utf-8"?>
<Project xmlns="{SCHEMA}/Project/3">
  <Parameters version="s7.10.2" stackSize="5000" millimeterUnit="true" />
  <Programs>
    <Program file="start.pgx" />
    <Program file="stop.pgx" />
    <Program file="cut.pgx" />
  </Programs>
  <Database>
    <Data file="cell.dtx" />
  </Database>
  <Libraries />
</Project>
"""
DATA = f"""<?xml version="1.0" encoding="utf-8"?>
<Database {XSI} xmlns="{SCHEMA}/Data/2">
  <Datas>
    <Data name="fPart" access="private" xsi:type="array" type="frame" size="1">
      <Value key="0" x="900" z="-100" rz="90" fatherId="world[0]" />
    </Data>
    <Data name="tMill" access="private" xsi:type="array" type="tool" size="1">
      <Value key="0" z="150" fatherId="flange[0]" ioLink="valve1" />
    </Data>
    <Data name="doSpindle" access="private" xsi:type="array" type="dio" size="1">
      <Value key="0" link="BasicIO-1\\%Q0" />
    </Data>
    <Data name="jHome" access="private" xsi:type="array" type="jointRx" size="1">
      <Value key="0" j3="90" j5="90" />
    </Data>
    <Data name="mFast" access="private" xsi:type="array" type="mdesc" size="1">
      <Value key="0" blend="off" />
    </Data>
    <Data name="mCut" access="private" xsi:type="array" type="mdesc" size="1">
      <Value key="0" tmax="25" rmax="9999" blend="Cartesian" leave="1" reach="1" />
    </Data>
    <Data name="nTurns" access="private" xsi:type="array" type="num" size="1">
      <Value key="0" value="2" />
    </Data>
    <Data name="pCut" access="private" xsi:type="array" type="pointRx" size="4">
      <Value key="0" z="50" rx="180" shoulder="lefty" elbow="epositive" wrist="wpositive" fatherId="fPart[0]" />
      <Value key="1" rx="180" fatherId="fPart[0]" />
      <Value key="2" x="10" rx="180" fatherId="fPart[0]" />
      <Value key="3" x="20" y="5.5E-01" rx="179.5" fatherId="fPart[0]" />
    </Data>
  </Datas>
</Database>
"""
START = """begin
  // the rim, "first" side
  movej(jHome,tMill,mFast)
  movej(pCut[0],tMill,mFast)
  waitEndMove()
  doSpindle=true
  call cut(nTurns)
  waitEndMove()
  doSpindle=false
end"""
CUT = """begin
  for l_nTurn=1 to x_nTurns
    movel(pCut[1],tMill,mCut)
    movel(pCut[2],tMill,mCut)
    movel(pCut[3],tMill,mFast)
    if l_nTurn==x_nTurns
      logMsg("done (at last)")
    else
      movel(pCut[0],tMill,mFast)
    endIf
  endFor
end"""
CUT_OWN = """<Parameters xmlns="http://www.staubli.com/robotics/VAL3/Param/1">
      <Parameter name="x_nTurns" type="num" xsi:type="element" />
    </Parameters>
    <Locals>
      <Local name="l_nTurn" type="num" xsi:type="array" size="1" />
    </Locals>
    """


FULL = """begin
  // été: comments may hold anything, "even strings
  switch nKind["FIRST"]
    case nKind["OTHER"]
      bOn=true
    break
    default
    break
  endSwitch
  if(!isPowered() and workingMode(nState[0])>=4)
    do
      enablePower()
      delay(2)
    until isPowered()
  elseIf (nState[1]!=2 or !bOn)
    popUpMsg("ready: "+toString("0.1",nState[1])+", press (start)")
    return
  endIf
  taskCreateSync "reader",0.004,bOverrun,read(siLink,true)
  taskCreate sName,10,lib:watchAll()
  nBytes=sioGet(siLink,nState)
  nBytes=$getBoxcarDelay()
  $setBoxcarFreq(60.0)
  trBack={0,0,-50,0,0,0}
  l_pPoint[0]=appro(pHome,{nState[0]/2,0,-10,0,0,0})
  movej(l_pPoint[0],flange,mNom)
  movel(compose(l_pPoint[0],fHome,trBack),tHand,mNom)
  l_pPoint[1].config.shoulder=lefty
  mNom.blend=joint
  mNom.vel=limit(nState[0]*100,1,100)
  open(tHand)
  mMsg.header.nKind=size(nState)
  mMsg.nData[nState[0]]=bNot(3)
  call read(siLink,false)
  call lib:reset(mMsg)
  while (true)
    nId=movel(appro(pHome,trBack),tHand,mNom)
    waitEndMove()
  endWhile
end"""
FULL_DATA = """<?xml version="1.0" encoding="utf-8" ?>
<Database xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xmlns="http://www.staubli.com/robotics/VAL3/Data/2">
  <Datas>
    <Data name="nKind" access="public" xsi:type="collection" type="num">
      <Value key="FIRST" value="1" />
      <Value key="OTHER" value="5.67105066906493E-05" />
    </Data>
    <Data name="nState" access="public" xsi:type="array" type="num" size="4" />
    <Data name="nBytes" access="private" xsi:type="array" type="num" size="1" />
    <Data name="nId" access="private" xsi:type="array" type="num" size="1" />
    <Data name="bOn" access="private" xsi:type="array" type="bool" size="1">
      <Value key="0" value="true" />
    </Data>
    <Data name="bOverrun" access="private" xsi:type="array" type="bool" size="1" />
    <Data name="sName" access="private" xsi:type="array" type="string" size="1">
      <Value key="0" value="a &quot;task&quot;" />
    </Data>
    <Data name="siLink" access="private" xsi:type="array" type="sio" size="1">
      <Value key="0" link="Socket\\one" />
    </Data>
    <Data name="mMsg" access="private" xsi:type="element" type="Message">
      <Value key="0"><Field name="header" xsi:type="element" type="Header"><Value key="0" /></Field></Value>
    </Data>
    <Data name="mNom" access="public" xsi:type="array" type="mdesc" size="1" />
    <Data name="trBack" access="private" xsi:type="array" type="trsf" size="1" />
    <Data name="fHome" access="private" xsi:type="array" type="frame" size="2">
      <Value key="1" fatherId="fHome[0]" />
    </Data>
    <Data name="pHome" access="private" xsi:type="array" type="pointRx" size="1">
      <Value key="0" x="700" ry="180" fatherId="fHome[1]" />
    </Data>
    <Data name="tHand" access="private" xsi:type="array" type="tool" size="1">
      <Value key="0" z="100" fatherId="flange[0]" ioLink="valve1" />
    </Data>
  </Datas>
</Database>
"""


def program(name: str, code: str, own: str = "") -> str:
    return f"""<?xml version="1.0" encoding="utf-8"?>
<Programs {XSI} xmlns="{SCHEMA}/Program/2">
  <Program name="{name}">
    {own}<Code><![CDATA[{code}]]></Code>
  </Program>
</Programs>
"""


CELL = {
    "cell.pjx": PROJECT,
    "cell.dtx": DATA,
    "start.pgx": program("start", START),
    "stop.pgx": program("stop", "begin\n  doSpindle=false\nend"),
    "cut.pgx": program("cut", CUT, CUT_OWN),
}


def written(files: dict[str, str | bytes], folder: Path) -> Path:
    """Write an application; texts get a byte order mark and CRLF, as on the controller."""
    for name, content in files.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(content, str):
            content = BOM + content.replace("\n", "\r\n").encode()
        file.write_bytes(content)
    return folder


def line_of(text: str, words: str) -> int:
    """Return the line of a text in which words stand first."""
    return text[: text.index(words)].count("\n") + 1
