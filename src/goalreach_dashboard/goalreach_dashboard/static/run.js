// The run: its finished paths, their table and files, recording, another run, and the replay of
// the last path, fuzzy beside crisp.
import { degrees, fixed, make } from './draw.js';

const COLUMNS = ['number', 'x_m', 'y_m', 'heading_deg', 'outcome', 'duration_s', 'length_m'];
const MAX_ROWS = 1000;
const REPLAY_MS = 5000;
function save(name, text, type) {
  const link = make('a', { href: URL.createObjectURL(new Blob([text], { type })), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

export function followRun(page) {
  const { find } = page;
  const run = { launched: false, onChange() {}, onEnd() {} };
  let about = {};
  let paths = [];
  let end = null;
  let recording = false;
  let frame = 0;

  run.restart = () => {
    about = {};
    paths = [];
    end = null;
    recording = false;
    page.set('ended', false);
    find('paths-rows').replaceChildren();
    summarise();
    run.onChange();
  };

  run.add = (event) => {
    const take = { begin, path, record, end: finish, refused }[event.event];
    take?.(event);
  };

  function begin(event) {
    run.restart();
    about = event;
    for (const [name, options, chosen] of [['run-arena', event.arenas, event.arena], ['run-policy', event.policies, event.policy]]) {
      find(name).replaceChildren(...options.map((option) => make('option', option === chosen ? { selected: '' } : {}, option)));
    }
    summarise();
  }

  function path(row) {
    paths.push(row);
    const number = (value, unit, digits = 2) => (value === undefined ? '–' : `${fixed(value, digits)} ${unit}`);
    const start = row.x_m === undefined ? '–' : `${number(row.x_m, 'm')}, ${number(row.y_m, 'm')}, ${degrees(row.heading_deg, 0)}`;
    const cells = [start, row.outcome, number(row.duration_s, 's', 1), number(row.length_m, 'm')];
    const line = make('tr', { class: ['goal', 'declared'].includes(row.outcome) ? 'goal' : 'failed' });
    line.append(make('th', { scope: 'row' }, row.number), ...cells.map((cell) => make('td', {}, cell)));
    find('paths-rows').prepend(line);
    while (find('paths-rows').children.length > MAX_ROWS) find('paths-rows').lastChild.remove();
    if (paths.length > MAX_ROWS) paths.shift();
    summarise();
  }

  function record(event) {
    recording = event.on;
    if (event.bag) about.bag = event.bag;
    if (event.error) page.answer(event.error);
    summarise();
  }

  function finish(event) {
    end = event;
    recording = false;
    page.set('ended', true);
    find('status').textContent = 'run ended';
    find('status').className = 'chip ended';
    run.onEnd();
    run.onChange();
    summarise();
  }

  function refused(event) { page.answer(`refused: ${event.reason}`); }

  function summary() {
    const count = {};
    for (const { outcome } of paths) count[outcome] = (count[outcome] || 0) + 1;
    return { outcomes: count, goals: count.goal || 0, paths: paths.length };
  }

  function summarise() {
    const { goals, outcomes, paths: total } = summary();
    const mean = (name, unit) => {
      const known = paths.map((each) => each[name]).filter((value) => value !== undefined);
      return known.length ? `, mean ${(known.reduce((a, b) => a + b) / known.length).toFixed(1)} ${unit}` : '';
    };
    const others = Object.entries(outcomes).filter(([name]) => name !== 'goal').map(([name, n]) => `, ${n} ${name}`);
    const text = total ? `${goals} of ${total} reached the goal${others.join('')}${mean('duration_s', 's')}${mean('length_m', 'm')}` : 'none has ended yet';
    find('paths-note').textContent = end ? `run ended: ${end.reason}. ${total ? text : 'No path was finished'}` : text;
    find('record').textContent = recording ? 'Stop recording' : 'Record';
    find('paths-table').parentElement.hidden = !total;
    find('save-json').disabled = find('save-csv').disabled = !total;
    find('bag-note').textContent = about.bag ? `${recording ? 'Recording into' : 'Recorded in'} ${about.bag}` : '';
    find('save-bag').hidden = !about.bag;
    run.allow(run.allowed, run.live);
  }

  // What the launcher executes needs the launcher; what a bag holds needs the page's process.
  run.allow = (allowed, live) => {
    [run.allowed, run.live] = [allowed, live];
    find('run-form').hidden = !allowed || !run.launched;
    find('run-stop').disabled = !live;
    find('run-summary').textContent = live ? 'Start or stop a run' : 'Start another run';
    find('save-bag').disabled = !allowed || recording;
    find('replay').hidden = !allowed;
    find('replay').disabled = !paths.length || page.is('lost');
  };

  // --- files
  const named = (suffix) => `goalreach-paths.${suffix}`;
  find('save-json').onclick = () => {
    const { arenas, policies, event, ...settings } = about;
    const shown = paths.map(({ event: _, ...each }) => each);
    save(named('json'), JSON.stringify({ ...settings, end: end?.reason ?? null, summary: summary(), paths: shown }, null, 1), 'application/json');
  };
  find('save-csv').onclick = () => {
    const lines = paths.map((each) => COLUMNS.map((name) => each[name] ?? '').join(','));
    save(named('csv'), `${[COLUMNS.join(','), ...lines].join('\r\n')}\r\n`, 'text/csv');
  };
  find('save-bag').onclick = () => page.command('bag');

  // --- another run
  find('record').onclick = () => page.command('record', !recording);
  find('run-stop').onclick = () => page.command('stop');
  find('run-starts').onchange = () => {
    const one = find('run-starts').value === 'pose';
    find('run-pose-label').hidden = !one;
    find('run-pose').required = one;
    if (one && !find('run-pose').value) find('run-pose').value = (find('pose-form').dataset.start || '').replaceAll(' ', ', ');
  };
  find('run-fields').onsubmit = (event) => {
    event.preventDefault();
    const starts = find('run-starts').value;
    page.command('start', {
      arena: find('run-arena').value,
      policy: find('run-policy').value,
      starts: starts === 'pose' ? find('run-pose').value : starts,
      paths: Number(find('run-paths').value),
    });
    page.answer('the run begins');
  };

  // --- the last path again, from the same start
  find('replay').onclick = () => {
    page.command('replay');
  };

  run.replay = ({ driven, paths: tracks }) => {
    cancelAnimationFrame(frame);
    const drawings = tracks.map((each) => drawing(each, driven));
    find('replay-panel').hidden = false;
    find('replay-pair').replaceChildren(...drawings.map((each) => each.figure));
    const longest = Math.max(...tracks.map((each) => each.length_m));
    const show = (share) => drawings.forEach((each) => each.show(share * longest));
    find('replay-time').oninput = ({ target }) => { cancelAnimationFrame(frame); show(Number(target.value)); };
    const began = performance.now();
    const advance = (now) => {
      const share = Math.min(1, (now - began) / REPLAY_MS);
      find('replay-time').value = share;
      show(share);
      if (share < 1) frame = requestAnimationFrame(advance);
    };
    if (page.calm()) { find('replay-time').value = 1; show(1); } else advance(began);
    find('replay-panel').scrollIntoView({ block: 'nearest' });
  };

  function drawing({ mode, m, outcome, length_m }, driven) {
    const [width, length] = (find('pose-form').dataset.size).split(' ').map((each) => 100 * each);
    const points = m.map(([x, y]) => [100 * x, length - 100 * y]);
    const title = `${mode}: ${outcome} after ${fixed(length_m, 2)} m`;
    const picture = make('svg:svg', { viewBox: `-6 -6 ${width + 12} ${length + 12}`, role: 'img', 'aria-label': title });
    const line = make('svg:polyline', { class: 'trail estimate-trail' });
    const robot = make('svg:circle', { class: 'body', r: 22.5 });
    const floor = find('floor').cloneNode(true);
    for (const each of [floor, ...floor.querySelectorAll('[data-testid]')]) each.removeAttribute('data-testid');
    picture.append(floor, make('svg:polyline', { class: 'trail', points: driven }), line, robot);
    const figure = make('figure');
    figure.append(picture, make('figcaption', {}, title));
    const show = (distance) => {
      const last = Math.min(points.length - 1, Math.round((distance / length_m) * (points.length - 1)) || 0);
      line.setAttribute('points', points.slice(0, last + 1).join(' '));
      robot.setAttribute('cx', points[last][0]);
      robot.setAttribute('cy', points[last][1]);
    };
    return { figure, show };
  }
  return run;
}
