// Controls: what steers the graph, what changes the page alone, and the keys of both.
import { make } from './draw.js';

const MIN_DRAG_CM = 12;
const NAMES = ['mode', 'speed', 'noise'];

export function steer(page, run) {
  const { find } = page;
  const arena = find('arena');
  const fields = ['place-x', 'place-y', 'place-heading'].map(find);
  const steering = { allowed: false };
  let pressed = null;

  // --- what there is to choose
  steering.offer = (hello) => {
    for (const name of NAMES) {
      const choice = find(`${name}-choice`);
      if (choice.querySelector('label')) continue;
      for (const value of hello[name]) {
        const label = make('label');
        label.append(make('input', { type: 'radio', name, value }), make('span', {}, name === 'speed' ? `${value}×` : value));
        choice.append(label);
      }
    }
    find('record').hidden = !hello.launched;
    run.launched = hello.launched;
  };

  // --- who may steer, and when
  steering.allow = (allowed) => {
    steering.allowed = allowed;
    const live = allowed && !page.is('lost') && !page.is('ended');
    find('steering').hidden = !allowed;
    find('read-only').hidden = allowed;
    find('steering').disabled = !live;
    if (!live) { place(false); aim(false); }
    run.allow(allowed && !page.is('lost'), live);
  };
  steering.answered = ({ answer, ticket, replay }) => {
    if (ticket) location.href = `/bag/${ticket}`;
    if (replay) run.replay(replay);
    if (!answer) return;
    page.answer(answer);
    if (answer.startsWith('at ')) place(false);
    if (answer.startsWith('refused')) page.send({ next: true }); // shows again what is so
  };
  run.onChange = () => steering.allow(steering.allowed);

  // --- buttons and choices
  find('pause').onclick = () => page.command('pause', page.text('pause') === 'Pause');
  find('step').onclick = () => page.command('step');
  for (const name of NAMES) {
    find(`${name}-choice`).onchange = ({ target }) => {
      page.command(name, name === 'speed' ? Number(target.value) : target.value);
    };
  }

  // --- placing
  function place(on) {
    if (on === page.is('placing')) return;
    page.set('placing', on);
    find('pose-form').hidden = !on;
    find('place-switch').setAttribute('aria-expanded', on);
    pressed = null;
    if (on) {
      fill((find('pose-form').dataset.start || '').split(' '));
      fields[0].focus();
    } else {
      find('preview').setAttribute('visibility', 'hidden');
      if (find('pose-form').contains(document.activeElement)) find('place-switch').focus();
    }
  }
  function size() {
    return (find('pose-form').dataset.size || '0 0').split(' ').map(Number);
  }
  function fill(values) {
    fields.forEach((field, index) => { field.value = values[index]; });
    const [width, length] = size();
    [fields[0].max, fields[1].max, fields[0].min, fields[1].min] = [width, length, 0, 0];
    preview();
  }
  function preview() {
    const [x, y, heading] = fields.map((field) => Number(field.value));
    const [, length] = size();
    const moved = `translate(${(100 * x).toFixed(1)} ${(100 * (length - y)).toFixed(1)})`;
    find('preview').setAttribute('transform', `${moved} rotate(${(-heading).toFixed(1)})`);
    find('preview').setAttribute('visibility', 'visible');
  }
  function sendPose() {
    page.command('place', fields.map((field) => (field.value === '' ? null : Number(field.value))));
  }
  function picturePoint(event) {
    const point = new DOMPoint(event.clientX, event.clientY);
    return point.matrixTransform(arena.getScreenCTM().inverse());
  }
  function drag(event) {
    const to = picturePoint(event);
    const [dx, dy] = [to.x - pressed.x, pressed.y - to.y];
    const dragged = Math.hypot(dx, dy) >= MIN_DRAG_CM;
    const heading = dragged ? (Math.atan2(dy, dx) * 180) / Math.PI : -90;
    const [, length] = size();
    const values = [pressed.x / 100, length - pressed.y / 100, heading];
    fill(values.map((value, index) => (value + 0).toFixed(index < 2 ? 2 : 0).replace(/^-0(\.0+)?$/, '0')));
  }
  find('place-switch').onclick = () => { aim(false); place(!page.is('placing')); };
  find('place-cancel').onclick = () => place(false);
  find('pose-form').onsubmit = (event) => { event.preventDefault(); sendPose(); };
  find('pose-form').oninput = preview;
  // --- moving the goal: the next press on the arena names its region
  function aim(on) {
    page.set('aiming', on);
    find('goal-switch').setAttribute('aria-pressed', on);
  }
  find('goal-switch').onclick = () => { place(false); aim(!page.is('aiming')); };
  arena.addEventListener('pointerdown', (event) => {
    if (!page.is('aiming') || event.button) return;
    event.preventDefault();
    const { x, y } = picturePoint(event);
    page.command('goal', [x / 100, size()[1] - y / 100]);
    aim(false);
  });
  arena.addEventListener('pointerdown', (event) => {
    if (!page.is('placing') || event.button) return;
    event.preventDefault();
    arena.setPointerCapture(event.pointerId);
    pressed = picturePoint(event);
    drag(event);
  });
  arena.addEventListener('pointermove', (event) => { if (pressed) drag(event); });
  arena.addEventListener('pointercancel', () => { pressed = null; });
  arena.addEventListener('pointerup', (event) => {
    if (!pressed) return;
    drag(event);
    pressed = null;
    sendPose();
  });

  // --- the page alone
  const setTheme = (value) => {
    document.documentElement.dataset.theme = value;
    page.remember('theme', value);
  };
  find('theme').onchange = ({ target }) => setTheme(target.value);
  for (const radio of find('theme').querySelectorAll('input')) {
    if (radio.value === page.recall('theme')) { radio.checked = true; setTheme(radio.value); }
  }
  const setValues = (on) => { page.set('show-q', on); page.remember('q', on ? 'on' : 'off'); };
  find('q-values').onchange = ({ target }) => setValues(target.checked);
  if (page.recall('q') === 'on') { find('q-values').checked = true; setValues(true); }
  find('keys').onclick = () => find('keys-dialog').showModal();

  // --- keys
  document.addEventListener('keydown', (event) => {
    if (event.key === 'Escape') { place(false); aim(false); }
    const busy = event.target.closest('input, select, textarea, dialog')
      || (event.key === ' ' && event.target.closest('button, summary, a, [tabindex]'));
    if (busy || event.ctrlKey || event.altKey || event.metaKey || event.repeat) return;
    const button = document.querySelector(`[data-key="${CSS.escape(event.key)}"]`);
    if (!button) return;
    event.preventDefault();
    if (!button.matches(':disabled') && button.offsetParent) button.click();
  });
  return steering;
}
