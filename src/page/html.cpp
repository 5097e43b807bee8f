#include "page/html.hpp"

#include <fmt/format.h>

namespace fathom::page {
namespace {

// The palette for the colour-blind by Okabe and Ito ("Color Universal Design", 2008), with yellow darkened for white
// paper.
constexpr const char* style = R"(
:root{--text:#1d2127;--faint:#5b6470;--line:#d9dee5;--page:#fff;--card:#f6f8fa;--pass:#1a7f37;--fail:#b3261e;--known:#8a5a00;
--c0:#0072b2;--c1:#d55e00;--c2:#009e73;--c3:#b0568c;--c4:#3d9ad1;--c5:#c98a00;--c6:#444b54;--c7:#857a00}
@media screen and (prefers-color-scheme:dark){:root{--text:#e6e9ee;--faint:#9aa4b2;--line:#323a45;--page:#14181d;--card:#1b2027;
--pass:#57c274;--fail:#ff7b72;--known:#e0b04a;--c0:#4da6e0;--c1:#ff8a3d;--c2:#2cc79a;--c3:#e29bc6;--c4:#8fd0f5;--c5:#f0b93a;--c6:#c3cad3;--c7:#d6cc4a}}
body{font:15px/1.5 system-ui,sans-serif;color:var(--text);background:var(--page);margin:2rem auto;max-width:62rem;padding:0 1rem}
h1{font-size:1.6rem}h2{font-size:1.2rem;margin-top:2.2rem;border-bottom:1px solid var(--line)}h3{font-size:1rem;margin:1.6rem 0 .2rem}
p{margin:.3rem 0}.faint{color:var(--faint)}table{border-collapse:collapse;margin:.6rem 0;width:100%}
th,td{text-align:left;padding:.2rem .6rem;border-bottom:1px solid var(--line);font-variant-numeric:tabular-nums}
th{font-weight:600;color:var(--faint)}caption{text-align:left;color:var(--faint);padding:.2rem 0}
td.n,th.n{text-align:right}tr.published td{color:var(--faint)}tr.group td{border-bottom:none;padding-top:.7rem;font-weight:600}
.pass{color:var(--pass)}.fail{color:var(--fail);font-weight:600}.known{color:var(--known)}
figure{margin:.4rem 0}svg{width:100%;max-width:42rem;background:var(--card);border-radius:6px;margin:.4rem 0}
svg text{font:11px system-ui,sans-serif;fill:var(--faint)}svg .title{font-weight:600;fill:var(--text)}
.grid{stroke:var(--line)}.c4,.c5,.c6,.c7{stroke-dasharray:7 2}.curve{fill:none;stroke-width:1.8}.again{stroke-dasharray:2 2.5}.reference{stroke-width:1.2;stroke-dasharray:2 4}.mark{stroke-dasharray:none}
.c0{stroke:var(--c0);color:var(--c0)}.c1{stroke:var(--c1);color:var(--c1)}.c2{stroke:var(--c2);color:var(--c2)}.c3{stroke:var(--c3);color:var(--c3)}
.c4{stroke:var(--c4);color:var(--c4)}.c5{stroke:var(--c5);color:var(--c5)}.c6{stroke:var(--c6);color:var(--c6)}.c7{stroke:var(--c7);color:var(--c7)}
svg text.name{stroke:none;fill:currentColor}figure.large svg{max-width:none}
td.whole,th.whole{font-weight:600;border-right:1px solid var(--line)}th.whole{color:var(--text)}
.best{text-decoration:underline;text-decoration-thickness:2px;text-underline-offset:3px}
dl{display:grid;grid-template-columns:max-content 1fr;gap:.2rem 1rem}dt{font-weight:600}dd{margin:0}details{margin:.4rem 0}summary{color:var(--faint);cursor:pointer}
.panels{display:grid;grid-template-columns:repeat(2,1fr);gap:.4rem}.panels svg{margin:0;max-width:none}
.legend{display:flex;flex-wrap:wrap;gap:.1rem 1.2rem;color:var(--faint);font-size:.85rem;margin:.4rem 0}
.legend svg{width:26px;height:10px;background:none;margin:0 .3rem 0 0}
.pictures{display:grid;grid-template-columns:repeat(3,1fr);gap:.4rem}.pictures img{width:100%;border-radius:6px;display:block}
.pictures figcaption{font-size:.85rem;color:var(--faint)}.wide{overflow-x:auto}nav{columns:2;margin:.6rem 0}nav a{display:block}
a{color:var(--c0)}li{margin:.2rem 0}
@media print{tr.group{break-after:avoid}body{max-width:none;margin:0;font-size:10pt}nav{display:none}h2,h3,tr:first-child,figcaption{break-after:avoid}
.wide{overflow:visible}table{font-size:8.5pt}th,td{padding:.15rem .35rem}
details::details-content{content-visibility:visible;block-size:auto}summary{list-style:none}
tr,figure,.panels svg,.pictures img{break-inside:avoid}svg,.card{print-color-adjust:exact;-webkit-print-color-adjust:exact}}
@media screen and (max-width:48rem){.panels,.pictures{grid-template-columns:1fr}nav{columns:1}}
)";

}  // namespace

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '&')
      out += "&amp;";
    else if (c == '"')
      out += "&quot;";
    else if (c == '\'')
      out += "&#39;";
    else
      out += c;
  }
  return out;
}

std::string document(std::string_view title, std::string_view body) {
  return fmt::format(
      "<!doctype html><html lang='en'><head><meta charset='utf-8'><meta name='viewport' content='width=device-width'>"
      "<title>{0}</title><style>{1}</style></head><body>\n<h1>{0}</h1>\n{2}</body></html>\n",
      escaped(title), style, body);
}

std::string to_html(const Table& table) {
  std::string html = fmt::format("<table><caption>{}</caption><tr>", escaped(table.title));
  for (const std::string& cell : table.head) html += "<th>" + escaped(cell) + "</th>";
  html += "</tr>";
  for (const auto& row : table.rows) {
    html += "<tr>";
    for (const std::string& cell : row) html += "<td>" + escaped(cell) + "</td>";
    html += "</tr>\n";
  }
  return html + "</table>\n";
}

}  // namespace fathom::page
