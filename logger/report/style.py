"""The style sheet of the page: one column of text and pictures, for light and dark screens and for paper.

The eight class colours run from blue over yellow and red to purple, fall in lightness from the third on, and are
apart with any common colour vision; a casing around them carries the light ones on white and the dark ones on black.
"""

from logger.chart_data import CLASS_COLOURS, NO_CLASS_COLOUR

_COLOURS = "".join(
    f"--{name}:{colour};" for name, colour in [*((f"c{number}", one) for number, one in enumerate(CLASS_COLOURS)),
                                               ("none", NO_CLASS_COLOUR)])
_LIGHT = _COLOURS + """
--ink:#1d242b;--soft:#5c6873;--line:#d9dee3;--faint:#eef1f4;--ground:#fff;--panel:#f7f9fa;--casing:#3c464f;
--band:#58a9d48c;
"""
_DARK = """
--ink:#e7ebee;--soft:#9ba7b1;--line:#343d45;--faint:#252d34;--ground:#14191e;
--panel:#1b2127;--casing:#c9d1d8;
"""
_CHART = """
svg{display:block;width:100%;height:auto}
svg text{font:12px system-ui,-apple-system,"Segoe UI",Roboto,"Noto Sans",sans-serif;fill:var(--soft)}
.s0{stroke:var(--c0)}.s1{stroke:var(--c1)}.s2{stroke:var(--c2)}.s3{stroke:var(--c3)}.s4{stroke:var(--c4)}
.s5{stroke:var(--c5)}
.s6{stroke:var(--c6)}.s7{stroke:var(--c7)}.sx{stroke:var(--none)}
.mark circle{fill:var(--ink);stroke:var(--ground);stroke-width:1.5}
svg .mark text{fill:var(--ground);font-size:10.5px;font-weight:650}
figure{margin:0 0 14px;overflow-x:auto}
@media screen and (max-width:640px){.named{min-width:640px}.plot:not(.named) .tick{font-size:17px}
.plot:not(.named) .line{stroke-width:2}.plot:not(.named) .thick{stroke-width:4}}
figcaption{font-size:13.5px;font-weight:600;margin-bottom:2px}
figcaption .unit{font-weight:400}
.grid{stroke:var(--faint);stroke-width:1}
.level{stroke:var(--line);stroke-dasharray:2 4}
.line{fill:none;stroke:var(--ink);stroke-width:1;stroke-linejoin:round;stroke-linecap:round}
.thick{fill:none;stroke-width:2;stroke-linejoin:round}.spread{stroke:none;fill:var(--c1);fill-opacity:.3}
.cell{fill:var(--c0)}
.band{fill:var(--c1);fill-opacity:.55}
"""
_PAGE = """
*{box-sizing:border-box}
body{margin:0;background:var(--ground);color:var(--ink);font:15px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,
"Noto Sans",sans-serif}
main{max-width:1060px;margin:0 auto;padding:36px 24px 64px}
h1{font-size:28px;line-height:1.2;font-weight:650;letter-spacing:-.01em;margin:0 0 4px}
h2{font-size:18px;font-weight:620;margin:44px 0 12px}
.sub,.unit,.empty,.hint{color:var(--soft)}
.sub{margin:0 0 24px}
.hint{font-size:13px;margin:8px 0 0}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(150px,1fr));gap:1px;
border:1px solid var(--line);
border-radius:8px;overflow:hidden;margin:0}
.tiles div{box-shadow:0 0 0 1px var(--line);padding:12px 16px}
.tiles dt{font-size:12.5px;color:var(--soft)}
.tiles dd{margin:0;font-size:22px;font-weight:600;font-variant-numeric:tabular-nums;white-space:nowrap}
.tiles small{font-size:13px;font-weight:400;color:var(--soft)}
.map{background:var(--panel);border:1px solid var(--line);border-radius:8px}
.map path{fill:none;stroke-linecap:round;stroke-linejoin:round}
.casing{stroke:var(--casing);stroke-width:8.5;stroke-opacity:.85}
.f0{background:var(--c0)}.f1{background:var(--c1)}.f2{background:var(--c2)}.f3{background:var(--c3)}
.f4{background:var(--c4)}.f5{background:var(--c5)}
.f6{background:var(--c6)}.f7{background:var(--c7)}.fx{background:var(--none)}
.start circle{fill:var(--ground);stroke:var(--ink);stroke-width:2.5}
.map .start text{font-weight:600;fill:var(--ink);paint-order:stroke;stroke:var(--panel);
stroke-width:4;stroke-linejoin:round}
.scale path{stroke:var(--soft);stroke-width:1.5}
.legend{display:flex;flex-wrap:wrap;gap:4px 18px;margin:10px 0 0;padding:0;list-style:none;font-size:13px;
color:var(--soft)}
.legend i,.bars i{display:inline-block;width:18px;height:6px;border-radius:3px;margin-right:7px;
vertical-align:2px;box-shadow:0 0 0 1px var(--casing)}
.columns{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(330px,100%),1fr));gap:0 48px}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-size:13.5px;font-variant-numeric:tabular-nums}
th{text-align:left;font-weight:600;color:var(--soft);font-size:12.5px;vertical-align:bottom}
th,td{padding:5px 12px 5px 0;border-bottom:1px solid var(--faint)}
td.n,th.n{text-align:right}
td.n,td:first-child{white-space:nowrap}
td.bar{width:50%;min-width:60px}
td.bar span{display:block;height:10px;border-radius:2px;min-width:2px}
a{color:inherit;text-decoration-color:var(--soft);text-underline-offset:2px}
details{margin-top:14px;border-top:1px solid var(--line);padding-top:12px}
summary{cursor:pointer;font-weight:600}
pre{background:var(--panel);border:1px solid var(--line);border-radius:8px;padding:14px;overflow:auto;
max-height:520px;font-size:12.5px;line-height:1.45}
pre.whole{max-height:none}
.lines{white-space:pre-line}
.notes{padding-left:18px;margin:14px 0 0}
.notes li{margin:3px 0}
.warn{font-weight:600}
@media(max-width:500px){main{padding:20px 14px 40px}h1{font-size:23px}h2{margin-top:32px}}
@media print{*{print-color-adjust:exact;-webkit-print-color-adjust:exact}main{padding:0;max-width:none}
section,tr,figure{break-inside:avoid}}
"""
STYLE = (f":root{{{_LIGHT}}}@media screen and (prefers-color-scheme:dark){{:root:not([data-paper]){{{_DARK}}}}}"
         f"{_CHART}{_PAGE}")
"""Of a page."""
CELL_STYLE = f".ridelog{{{_LIGHT}{_CHART}}}@media(prefers-color-scheme:dark){{.ridelog{{{_DARK}}}}}"
"""Of charts in somebody else's page: inside an element of the class ``ridelog`` and nowhere else (nested rules, CSS
Nesting Module)."""
