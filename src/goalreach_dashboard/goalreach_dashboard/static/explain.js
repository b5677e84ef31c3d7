// Explains a figure on hover, focus and touch; the words are those of help.html.
import { describe } from './describe.js';

const HELP = '/help.html';

export function explain(page) {
  const tip = page.find('tip');
  let texts = null;
  let shown = null;

  async function load() {
    const answer = await fetch(HELP);
    const other = new DOMParser().parseFromString(await answer.text(), 'text/html');
    texts = new Map([...other.querySelectorAll('dt[id]')].map((term) => [term.id, term.nextElementSibling.textContent]));
  }

  async function show(button) {
    shown = button;
    if (!texts) await load();
    if (shown !== button) return;
    const key = button.dataset.term;
    const link = document.createElement('a');
    link.href = `${HELP}#${key}`;
    link.target = '_blank';
    link.textContent = 'more';
    link.onblur = leave;
    tip.replaceChildren(texts.get(key) ?? '', ' ', link);
    tip.hidePopover();
    // Tab leads from the term to the link in its tip.
    (button.parentElement.tagName === 'LEGEND' ? button.parentElement : button).after(tip);
    tip.showPopover();
    const place = button.getBoundingClientRect();
    const width = tip.offsetWidth;
    tip.style.left = `${Math.max(8, Math.min(place.left, document.documentElement.clientWidth - width - 8))}px`;
    const below = place.bottom + tip.offsetHeight + 8 < innerHeight || place.top < tip.offsetHeight;
    tip.style.top = `${below ? place.bottom : place.top - tip.offsetHeight - 8}px`;
    button.setAttribute('aria-describedby', 'tip');
  }

  function hide() {
    shown?.removeAttribute('aria-describedby');
    shown = null;
    tip.hidePopover();
  }
  // The pointer may move onto the tip, and the focus onto its link.
  function leave() {
    setTimeout(() => {
      const kept = [shown, tip].some((each) => each?.matches(':hover, :focus-within'));
      if (!kept) hide();
    }, 150);
  }

  for (const term of document.querySelectorAll('[data-help]')) {
    const button = document.createElement('button');
    button.type = 'button';
    button.className = 'term';
    button.dataset.term = term.dataset.help;
    button.append(...term.childNodes);
    term.append(button);
    button.onmouseenter = button.onfocus = button.onclick = () => show(button);
    button.onmouseleave = button.onblur = leave;
  }
  tip.onmouseleave = leave;
  document.addEventListener('keydown', (event) => { if (event.key === 'Escape') hide(); });
  page.find('describe').onclick = () => describe(page, true);
}
