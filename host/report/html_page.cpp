// Style and script of a report. System fonts, two colour schemes, one accent; figures set in tabular numerals.
#include "host/report/html_page.hpp"

namespace clerestory {

const char* const kPageStyle = R"css(
:root{color-scheme:light dark;--paper:#fbfaf7;--card:#f3f1ec;--ink:#1e2124;--soft:#5f656b;--rule:#dedad2;--accent:#a8541c;
--stage:#17181a;--sans:ui-sans-serif,system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif;
--mono:ui-monospace,SFMono-Regular,Menlo,Consolas,"DejaVu Sans Mono",monospace}
@media (prefers-color-scheme:dark){:root{--paper:#16181a;--card:#1f2225;--ink:#e7e5e0;--soft:#9aa0a6;--rule:#33373b;
--accent:#e39a63;--stage:#0c0d0e}}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%}
body{margin:0;background:var(--paper);color:var(--ink);font:16px/1.55 var(--sans);text-rendering:optimizeLegibility}
main,footer{max-width:74rem;margin:0 auto;padding:0 clamp(1rem,4vw,3rem)}
header{padding:clamp(2rem,6vw,4.5rem) 0 1.5rem}
header .house{font-size:.75rem;letter-spacing:.14em;text-transform:uppercase;color:var(--accent);margin:0 0 .6rem}
h1{font-size:clamp(1.7rem,1.2rem + 2vw,2.5rem);line-height:1.15;font-weight:600;letter-spacing:-.015em;margin:0;
overflow-wrap:anywhere}
header .subtitle{color:var(--soft);font-size:1.05rem;margin:.7rem 0 0;max-width:44rem}
nav{display:flex;flex-wrap:wrap;gap:.3rem 1.4rem;padding:.8rem 0;border-block:1px solid var(--rule);font-size:.88rem}
nav a{color:var(--soft);text-decoration:none}
nav a:hover,nav a:focus-visible{color:var(--accent)}
h2{font-size:1.3rem;line-height:1.25;font-weight:600;letter-spacing:-.008em;margin:3.2rem 0 .4rem;scroll-margin-top:1rem}
p{max-width:44rem;margin:.5rem 0 1rem}
figure{margin:1.2rem 0 2rem}
figcaption{font-size:.88rem;line-height:1.45;color:var(--soft);margin-top:.55rem;max-width:48rem}
figcaption b{color:var(--ink);font-weight:600}
.facts{display:grid;grid-template-columns:repeat(auto-fit,minmax(11rem,1fr));gap:1.1rem 2rem;margin:1.4rem 0 2rem}
.facts div{border-top:1px solid var(--rule);padding-top:.5rem}
.facts dt{font-size:.8rem;color:var(--soft)}
.facts dd{margin:.15rem 0 0;font-size:1rem;line-height:1.4;font-variant-numeric:tabular-nums;overflow-wrap:anywhere}
.facts dt::first-letter{text-transform:uppercase}
.grid{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,19rem),1fr));gap:1.6rem 1.2rem;margin:1.2rem 0 .6rem}
.grid figure{margin:0}
.grid img{display:block;width:100%;border-radius:3px;background:var(--stage);cursor:zoom-in}
.grid img.small,dialog img.small{image-rendering:pixelated}
.grid figure.row{grid-column:1/-1}
.grid figcaption span{display:block}
.bar-of-colours{margin-top:.5rem;font-size:.8rem;color:var(--soft);font-variant-numeric:tabular-nums}
.bar-of-colours div{height:.7rem;border:1px solid var(--rule);border-radius:2px;-webkit-print-color-adjust:exact;print-color-adjust:exact}
.bar-of-colours p{display:flex;justify-content:space-between;margin:.2rem 0 0;max-width:none}
.columns{display:flex;margin:.4rem 0 0;max-width:none;font-size:.8rem;line-height:1.3;color:var(--soft)}
.columns span{flex:1 1 0;min-width:0;padding-right:.4rem;overflow-wrap:anywhere}
.notes{display:grid;grid-template-columns:max-content minmax(0,48rem);gap:.45rem 1.6rem;margin:1.2rem 0 2rem;
font-size:.93rem}
.notes dt{color:var(--soft)}.notes dt::first-letter{text-transform:uppercase}
.notes dd{margin:0;overflow-wrap:anywhere}
.wide{overflow-x:auto;margin-bottom:0}
table{border-collapse:collapse;font-size:.93rem;font-variant-numeric:tabular-nums;min-width:22rem}
th,td{padding:.42rem 1.1rem .42rem 0;text-align:left;vertical-align:baseline}
th{font-weight:600;font-size:.82rem;border-bottom:1px solid var(--ink);white-space:nowrap}
th small{font-weight:400;font-size:.95em;color:var(--soft);margin-left:.3em}
td{border-bottom:1px solid var(--rule)}
.number{text-align:right;white-space:nowrap;padding-left:.8rem}
td strong{font-weight:700}
td .deviation{color:var(--soft);font-weight:400}
.plot svg,.plot img{display:block;width:100%;max-width:46rem;height:auto}
.plot svg text{font-family:var(--sans)}
.plot .gridline{stroke:var(--rule)}
@media (prefers-color-scheme:dark){.plot svg{filter:brightness(1.2)}.plot img{filter:brightness(1.6)}}
.plot [fill="rgb(91,96,102)"]{fill:var(--soft)}
.plot [stroke="rgb( 91,  96, 102)"]{stroke:var(--soft)}
.compare .stage{position:relative;overflow:hidden;border-radius:3px;background:var(--stage);margin:0 auto;--at:50%}
.compare .side{position:absolute;inset:0}
.compare .side img{position:absolute;inset:0;width:100%;height:100%;visibility:hidden}
.compare .side img.shown{visibility:visible}
.compare .first{clip-path:inset(0 calc(100% - var(--at)) 0 0)}
.compare .bar{position:absolute;top:0;bottom:0;left:var(--at);width:2px;margin-left:-1px;background:#fff;
box-shadow:0 0 6px #0009;pointer-events:none}
.compare .bar::after{content:"";position:absolute;top:50%;left:50%;width:30px;height:30px;margin:-15px;border-radius:50%;
border:2px solid #fff;background:#0006;box-shadow:0 0 6px #0006}
.compare .tag{position:absolute;top:.7rem;padding:.12rem .55rem;border-radius:2px;background:#000a;color:#fff;font-size:.8rem;
pointer-events:none}
.compare .tag.left{left:.7rem}.compare .tag.right{right:.7rem}
.compare .wipe{position:absolute;inset:0;width:100%;height:100%;margin:0;opacity:0;cursor:ew-resize}
.compare .wipe:focus-visible + .bar{background:var(--accent)}
.compare.difference .first{clip-path:none;mix-blend-mode:difference}
.compare.difference .bar,.compare.difference .tag{display:none}
.compare .controls{display:flex;flex-wrap:wrap;align-items:center;gap:.5rem 1.6rem;margin:.7rem auto 0;font-size:.88rem;
color:var(--soft)}
.compare .controls label{display:flex;align-items:center;gap:.6rem}
.compare .controls output{min-width:4.4em;color:var(--ink);font-variant-numeric:tabular-nums}
.compare .controls button{font:inherit;padding:.1rem .6rem;color:inherit;background:none;border:1px solid var(--rule);
border-radius:3px;cursor:pointer}
input{accent-color:var(--accent)}
details{border-top:1px solid var(--rule);padding:.7rem 0}
details:last-of-type{border-bottom:1px solid var(--rule)}
details>:not(summary){margin-left:1.1rem}
summary{cursor:pointer;font-weight:600;font-size:.95rem}
summary:hover{color:var(--accent)}
pre{font:.82rem/1.5 var(--mono);background:var(--card);border-radius:3px;padding:.8rem 1rem;overflow-x:auto;margin:.7rem 0}
footer{margin-top:4rem;padding-top:1.6rem;padding-bottom:3rem;color:var(--soft);font-size:.86rem}
footer::before{content:"";display:block;border-top:1px solid var(--rule);margin-bottom:1.4rem}
footer dl{display:grid;grid-template-columns:max-content 1fr;gap:.25rem 1.6rem;margin:0 0 1.2rem}
footer dt{color:var(--soft)}footer dd{margin:0;color:var(--ink);overflow-wrap:anywhere}
.command{position:relative;max-width:60rem}
.command pre{color:var(--ink);white-space:pre-wrap;overflow-wrap:anywhere;padding-right:5rem}
.command button{position:absolute;top:.55rem;right:.6rem;font:.8rem var(--sans);padding:.15rem .6rem;color:var(--soft);
background:var(--paper);border:1px solid var(--rule);border-radius:3px;cursor:pointer}
dialog{border:0;padding:0;max-width:96vw;max-height:96vh;background:none;color:#fff}
dialog::backdrop{background:#000d}
dialog img{display:block;max-width:96vw;max-height:88vh;min-width:min(90vw,60vh);cursor:zoom-out;margin:auto}
dialog p{margin:.6rem auto 0;text-align:center;font-size:.9rem}
@media print{nav,.controls,.command button{display:none}body{background:#fff;color:#000}figure,table{break-inside:avoid}
.grid{grid-template-columns:repeat(3,1fr)}}
@media (max-width:34rem){footer dl,.notes{grid-template-columns:1fr;gap:0}footer dd,.notes dd{margin-bottom:.5rem}}
)css";

const char* const kPageScript = R"js(
'use strict';
// Two pictures under one bar. Each side holds the same picture at several stored exposures. Shown values are
// radiance^(1/2.2), so a gain g of the radiance is a gain g^(1/2.2) of what is shown: a CSS brightness. The brightest
// stored exposure not above the wanted one is taken, so highlights return when the exposure falls.
for (const figure of document.querySelectorAll('.compare')) {
  const stage = figure.querySelector('.stage'), wipe = figure.querySelector('.wipe');
  const exposure = figure.querySelector('.exposure'), output = figure.querySelector('output');
  const place = () => stage.style.setProperty('--at', wipe.value + '%');
  const expose = () => {
    const ev = Number(exposure.value);
    for (const side of figure.querySelectorAll('.side')) {
      const images = [...side.querySelectorAll('img')];
      const fits = images.filter(image => Number(image.dataset.ev) <= ev);
      const level = fits.length ? Math.max(...fits.map(image => Number(image.dataset.ev)))
                                : Math.min(...images.map(image => Number(image.dataset.ev)));
      for (const image of images) {
        image.classList.toggle('shown', Number(image.dataset.ev) === level);
        image.style.filter = 'brightness(' + Math.pow(2, (ev - level) / 2.2) + ')';
      }
    }
    output.textContent = (ev > 0 ? '+' : ev < 0 ? '\u2212' : '') + Math.abs(ev).toFixed(1) + ' EV';
  };
  wipe.addEventListener('input', place);
  exposure.addEventListener('input', expose);
  figure.querySelector('.reset').addEventListener('click', () => { exposure.value = 0; wipe.value = wipe.defaultValue;
    expose(); place(); });
  figure.querySelector('.minus').addEventListener('change', event =>
    figure.classList.toggle('difference', event.target.checked));
  place(); expose();
}
const dialog = document.querySelector('dialog');
const open = image => {
  const large = dialog.querySelector('img');
  large.src = image.src; large.alt = image.alt; large.className = image.className;
  dialog.querySelector('p').textContent = image.alt;
  dialog.showModal();
};
for (const image of document.querySelectorAll('.grid img')) {
  image.tabIndex = 0;
  image.addEventListener('click', () => open(image));
  image.addEventListener('keydown', event => { if (event.key === 'Enter') open(image); });
}
dialog.addEventListener('click', () => dialog.close());
for (const button of document.querySelectorAll('.command button'))
  button.addEventListener('click', async () => {
    const text = button.parentElement.querySelector('pre').textContent;
    try { await navigator.clipboard.writeText(text); button.textContent = 'Copied'; }
    catch { getSelection().selectAllChildren(button.parentElement.querySelector('pre')); button.textContent = 'Selected'; }
  });
)js";

}  // namespace clerestory
