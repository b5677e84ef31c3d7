// The live page: keeps the connection and paints what comes; elements carry their names as
// data-testid. The page asks for the next difference when it has painted the last: a hidden page
// asks for none.
import { drawer } from './draw.js';
import { explain } from './explain.js';
import { followRun } from './run.js';
import { steer } from './steer.js';
import { describe, drawError } from './describe.js';

const RETRY_MS = 1000;
const CALM_MS = 500; // between frames, for people who prefer reduced motion
const SILENCE_MS = 3000;
const KEY = 'token';
const calm = matchMedia('(prefers-reduced-motion: reduce)');
const elements = new Map();
for (const each of document.querySelectorAll('[data-testid]')) elements.set(each.dataset.testid, each);

const page = {
  body: document.body,
  find: (name) => elements.get(name),
  text: (name) => (elements.get(name)?.textContent || '').trim(),
  send(message) {
    if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
  },
  command: (name, value = null) => page.send({ do: name, value }),
  answer: (text) => { elements.get('answer').textContent = text; },
  is: (name) => document.body.classList.contains(name),
  set: (name, on) => document.body.classList.toggle(name, on),
  calm: () => calm.matches,
  // What a person chose stays chosen over a reload; without storage it does not.
  remember(name, value) { try { localStorage.setItem(name, value); } catch { /* not allowed */ } },
  recall(name) { try { return localStorage.getItem(name); } catch { return null; } },
};

let socket = null;
let painted = 0;

function token() {
  const given = new URLSearchParams(location.hash.slice(1)).get(KEY);
  if (given !== null) {
    history.replaceState(null, '', location.pathname);
    try { sessionStorage.setItem(KEY, given); } catch { page.token = given; }
  }
  try { return sessionStorage.getItem(KEY); } catch { return page.token ?? null; }
}

function connect() {
  const ours = new WebSocket(`ws://${location.host}/live`);
  socket = ours;
  let accepted = false;
  ours.onopen = () => ours.send(JSON.stringify({ token: token() }));
  ours.onmessage = (event) => {
    if (ours !== socket) return;
    const message = JSON.parse(event.data);
    if (message.hello) {
      accepted = true;
      page.set('lost', false);
      page.set('ended', false);
      steering.offer(message.hello);
      steering.allow(message.hello.steers);
      ours.send('{"next": true}');
    }
    if (message.show) apply(message.show, message.events);
    if (!message.show && !message.hello) steering.answered(message);
  };
  ours.onclose = (event) => {
    if (ours !== socket) return;
    socket = null;
    if (!accepted && event.code === 1008) {
      elements.get('status').textContent = 'open the link with the token';
      return;
    }
    lose();
    // The summary of a run that has ended stays; another one on this port has its own page.
    if (!page.is('ended')) setTimeout(connect, RETRY_MS);
  };
}

function lose() {
  page.set('lost', true);
  steering.allow(steering.allowed);
  if (!page.is('ended')) {
    const status = elements.get('status');
    status.textContent = 'connection lost';
    status.className = 'chip down';
  }
}

function apply(difference, events) {
  painted = performance.now();
  page.set('waiting', false);
  if ('robot' in difference) run.restart(); // a whole view: all events of its robot follow
  const changed = drawing.apply(difference);
  for (const event of events) run.add(event);
  if (changed.has('stamp')) drawError(page, drawing.view());
  describe(page, false);
  const next = () => requestAnimationFrame(() => page.send({ next: false }));
  if (page.calm()) setTimeout(next, CALM_MS); else next();
}

// A frame can be lost while a machine sleeps: after three seconds ask for the whole view.
setInterval(() => {
  const silent = performance.now() - painted > SILENCE_MS;
  if (!document.hidden && silent && socket?.readyState === WebSocket.OPEN && !page.is('waiting')) {
    page.send({ next: true });
  }
}, 1500);
elements.get('robot-choice').onchange = ({ target }) => page.send({ robot: target.value });
addEventListener('hashchange', () => { if (location.hash.includes(`${KEY}=`)) location.reload(); });

const drawing = drawer(page);
const run = followRun(page);
const steering = steer(page, run);
run.onEnd = drawing.ended;
explain(page);
connect();
