// Draws the values of the view. Lengths of the view are metres, angles degrees, counter-clockwise;
// those of the arena's picture are centimetres, y downward from the far wall.
const VIEW_CM = 130;
const COMMAND_CM = 62;
const WINDOW = 22;
const SVG = 'http://www.w3.org/2000/svg';

// Zero has no sign.
export const fixed = (value, digits) => (Math.round(value * 10 ** digits) === 0 ? 0 : value).toFixed(digits);
export const metres = (value) => `${fixed(value, 3)} m`;
export const degrees = (value, digits = 1) => {
  const text = fixed(value, digits);
  return `${Number(text) === -180 ? text.slice(1) : text}°`;
};
const r = (value) => fixed(value, 1);
const polar = (length, angle) => {
  const radians = (angle * Math.PI) / 180;
  return [length * Math.cos(radians), -length * Math.sin(radians)];
};
const rotate = (angle) => `rotate(${r(-angle)})`;

export function make(tag, attributes = {}, text = '') {
  const element = tag.startsWith('svg:') ? document.createElementNS(SVG, tag.slice(4)) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.textContent = text;
  return element;
}

// Each painter with the values that it shows; it runs when one of them has changed.
export function drawer(page) {
  const { find } = page;
  let view = {};
  const text = (name, value) => { const element = find(name); if (element.textContent !== value) element.textContent = value; };
  const set = (name, attributes) => { for (const [key, value] of Object.entries(attributes)) find(name).setAttribute(key, value); };
  const see = (name, visible, attributes = {}) => set(name, { visibility: visible ? 'visible' : 'hidden', ...(visible ? attributes : {}) });
  // Fragments hold numbers and names of this project, or what the server has escaped.
  const html = (name, value) => { find(name).innerHTML = value; };
  const cm = ([x, y]) => [100 * x, 100 * (view.arena.size[1] - y)];
  const move = (at) => { const [x, y] = cm(at); return `translate(${r(x)} ${r(y)})`; };
  const arrow = (style, angle, length, width) => {
    const [x, y] = polar(length, angle);
    return `<line class="${style}" x2="${r(x)}" y2="${r(y)}" marker-end="url(#head)"${width ? ` stroke-width="${r(width)}"` : ''}/>`;
  };
  const arc = (radius, centre, width) => {
    const [[x0, y0], [x1, y1]] = [centre - width / 2, centre + width / 2].map((angle) => polar(radius, angle));
    return `${r(x0)} ${r(y0)}A${radius} ${radius} 0 0 0 ${r(x1)} ${r(y1)}`;
  };
  const regions = () => view.arena.labels[0].flatMap((_, i) => view.arena.labels[1].map((__, j) => [i, j]));
  const centre = ([i, j]) => {
    const [x, y] = view.arena.borders;
    return cm([(x[i] + x[i + 1]) / 2, (y[j] + y[j + 1]) / 2]);
  };
  const isGoal = ([i, j]) => i === view.arena.goal[0] && j === view.arena.goal[1];

  function floor() {
    const { size, knots, borders, labels, leds } = view.arena;
    const [width, length] = size.map((each) => 100 * each);
    const [[x, y], [xs, ys]] = [knots, borders];
    const area = (style, x0, y0, x1, y1, more = '') => `<rect class="${style}" x="${r(100 * x0)}" y="${r(length - 100 * y1)}" width="${r(100 * (x1 - x0))}" height="${r(100 * (y1 - y0))}"${more}/>`;
    const [gi, gj] = view.arena.goal;
    const parts = [
      area('floor', 0, 0, ...size),
      ...view.arena.forbidden.map(([i, j]) => area('forbidden', xs[i], ys[j], xs[i + 1], ys[j + 1], ' data-testid="forbidden"')),
      area('goal', xs[gi], ys[gj], xs[gi + 1], ys[gj + 1], ' data-testid="goal"'),
      ...xs.slice(1, -1).map((_, n) => area('fade', x[2 * n + 1], 0, x[2 * n + 2], size[1])),
      ...ys.slice(1, -1).map((_, n) => area('fade', 0, y[2 * n + 1], size[0], y[2 * n + 2])),
      ...xs.slice(1, -1).map((each) => `<path class="border" d="M${r(100 * each)} 0V${r(length)}"/>`),
      ...ys.slice(1, -1).map((each) => `<path class="border" d="M0 ${r(length - 100 * each)}H${r(width)}"/>`),
      ...regions().map(([i, j]) => {
        const [left, top] = [r(100 * xs[i] + 6), length - 100 * ys[j + 1]];
        return `<text class="region" x="${left}" y="${r(top + 13)}">${labels[0][i]}</text>`
          + `<text class="region" x="${left}" y="${r(top + 24)}">${labels[1][j]}${isGoal([i, j]) ? ' · GOAL' : ''}</text>`;
      }),
      `<rect class="wall" x="-2.5" y="-2.5" width="${r(width + 5)}" height="${r(length + 5)}"/>`,
      `<path class="goal-wall" d="M-5 ${r(length + 2.5)}H${r(width + 5)}"/>`,
    ];
    set('arena', { viewBox: `-12 -12 ${(width + 24).toFixed(0)} ${(length + 38).toFixed(0)}` });
    html('floor', parts.join(''));
    html('leds', leds.map((led, n) => `<g class="led" data-testid="led-${n + 1}" transform="${move(led)}"><path d="M0 -6 6 0 0 6 -6 0z"/><text y="19">LED ${n + 1}</text></g>`).join(''));
    for (const axis of [0, 1]) {
      const ends = knots[axis];
      const at = ends.map((each) => abscissa(each, ends));
      const line = (n, points) => `<polyline class="set set-${n}" points="${points.map(([k, v]) => `${r(at[k])},${v}`).join(' ')}"/>`;
      html(`sets-${'xy'[axis]}`, '<path class="axis" d="M8 74H392"/>'
        + labels[axis].map((_, n, all) => line(n % 3, [...(n ? [[2 * n - 1, 74]] : []), [2 * n, 20], [2 * n + 1, 20], ...(n < all.length - 1 ? [[2 * n + 2, 74]] : [])])).join('')
        + labels[axis].map((label, n) => `<text class="label" x="${r((at[2 * n] + at[2 * n + 1]) / 2)}" y="13">${label}</text>`).join('')
        + ends.map((each, n) => `<text class="knot" x="${r(at[n])}" y="88">${fixed(each, 2)}</text>`).join(''));
    }
    const { dataset } = find('pose-form');
    dataset.size = size.join(' ');
    dataset.start = `${fixed(size[0] / 2, 2)} ${fixed(size[1] / 2, 2)} -90`;
  }

  const abscissa = (value, knots) => 8 + 384 * Math.min(1, Math.max(0, (value - knots[0]) / (knots.at(-1) - knots[0])));

  function robot() {
    const { truth, camera, bumpers } = view;
    see('robot', truth, truth && { transform: move(truth) });
    see('camera-view', truth && camera !== null);
    see('turret', truth && camera !== null);
    see('needle', truth);
    if (!truth) { html('sight-lines', ''); return; }
    set('needle', { transform: rotate(truth[2]) });
    set('drive-heading', { transform: rotate(truth[2]) });
    html('bumpers', bumpers.map(([n, of]) => `<path d="M${arc(25.5, (360 / of) * n, 360 / of)}"/>`).join(''));
    if (camera === null) return;
    set('turret', { transform: rotate(camera) });
    set('camera-view', { d: `M0 0L${arc(VIEW_CM, camera, view.fov)}z`, transform: move(truth) });
    const [x, y] = cm(truth);
    const seen = view.lost ? [] : view.seen.filter((n) => view.arena.leds[n]);
    html('sight-lines', seen.map((n) => { const [u, v] = cm(view.arena.leds[n]); return `<path d="M${r(x)} ${r(y)}L${r(u)} ${r(v)}"/>`; }).join(''));
  }

  function estimate() {
    const { estimate: found, lost } = view;
    see('estimate', found, found && { transform: move(found.pose), class: lost ? 'estimate old' : 'estimate' });
    row('estimate-x', 'estimate-y', 'estimate-heading-text', found?.pose);
    row('sigma-x', 'sigma-y', 'sigma-heading', found?.sigma);
    if (!found) return;
    const [long, short, angle] = found.ellipse;
    set('ellipse', { rx: r(100 * long), ry: r(100 * short), transform: rotate(angle) });
    set('estimate-heading', { transform: rotate(found.pose[2]) });
    find('estimate-row').dataset.stamp = view.stamp;
  }
  const row = (x, y, heading, pose) => {
    text(x, pose ? metres(pose[0]) : '–');
    text(y, pose ? metres(pose[1]) : '–');
    text(heading, pose ? degrees(pose[2]) : '–');
  };

  function odometry() {
    const { odometry: pose, error, compared } = view;
    see('odometry', pose, pose && { transform: `${move(pose)} ${rotate(pose[2])}` });
    row('odometry-x', 'odometry-y', 'odometry-heading', pose);
    row('truth-x', 'truth-y', 'truth-heading', compared);
    text('error-position', error ? metres(error[0]) : '–');
    text('error-heading', error ? degrees(error[1]) : '–');
  }

  function policy() {
    const { policy: found, votes } = view;
    const share = (i, j) => votes.filter(([[k, l]]) => k === i && l === j).reduce((sum, vote) => sum + vote[2], 0);
    const action = ([i, j]) => found?.actions[i][j] ?? null;
    html('cells', regions().filter((each) => action(each) !== null).map((each) => {
      const [x, y] = centre(each);
      const angle = found.headings[action(each)];
      const [dx, dy] = polar(17, angle);
      const weight = share(...each);
      return `<g transform="translate(${r(x - dx)} ${r(y - dy)})">${arrow(weight ? 'arrow votes' : 'arrow', angle, 34, 3.5 + 2.5 * weight)}</g>`;
    }).join(''));
  }

  function values() {
    const found = view.policy;
    if (!found) { html('q-charts', ''); html('q-table', ''); return; }
    const { q, headings } = found;
    const scale = Math.max(1e-9, ...q.flat(2).map(Math.abs));
    const others = regions().filter((each) => !isGoal(each));
    html('q-charts', others.map(([i, j]) => {
      const [x, y] = centre([i, j]);
      const spokes = q[i][j].map((value, n) => {
        const [[u, v], [a], [, b]] = [polar((34 * Math.abs(value)) / scale, headings[n]), polar(48, headings[n]), polar(45, headings[n])];
        return `<line class="${value < 0 ? 'minus' : 'plus'}" x2="${r(u)}" y2="${r(v)}"/><text x="${r(a)}" y="${r(b + 3)}">${fixed(value, 2)}</text>`;
      });
      return `<g transform="translate(${r(x)} ${r(y)})"><circle r="34"/>${spokes.join('')}</g>`;
    }).join(''));
    const order = headings.map((_, n) => n).sort((a, b) => headings[a] - headings[b]);
    const [xs, ys] = view.arena.labels;
    const head = order.map((n) => `<th scope="col">${degrees(headings[n], 0)}</th>`).join('');
    html('q-table', `<thead><tr><th scope="col">region</th>${head}</tr></thead><tbody>${others.map(([i, j]) => {
      const best = Math.max(...q[i][j]);
      const cells = order.map((n) => {
        const value = q[i][j][n];
        const shade = `${value < 0 ? 'minus' : 'plus'}-${Math.round((9 * Math.abs(value)) / scale)}`;
        return `<td class="${shade}${value === best && value ? ' best' : ''}">${fixed(value, 2)}</td>`;
      });
      return `<tr><th scope="row">${xs[i]}/${ys[j]}</th>${cells.join('')}</tr>`;
    }).join('')}</tbody>`);
  }

  function decision() {
    const { votes, heading, estimate: found, lost } = view;
    html('vote-arrows', votes.map(([, , share, angle]) => arrow('vote', angle, 14 + 68 * share)).join(''));
    html('votes', votes.map(([, name, share, angle]) => '<li><svg class="bar" viewBox="0 0 100 4" preserveAspectRatio="none" aria-hidden="true"><rect class="whole" width="100" height="4"/>'
      + `<rect width="${r(100 * share)}" height="4"/></svg><b>${fixed(100 * share, 0)} %</b> <span>${name}</span> <i>${degrees(angle, 0)}</i></li>`).join(''));
    const known = heading !== null;
    const exploring = view.learning && view.last;
    text('commanded-text', known ? degrees(heading) : exploring ? 'exploring' : '–');
    text('decision-note', view.note);
    const [x, y] = known ? polar(82, heading) : [0, 0];
    see('blend', known, { x2: r(x), y2: r(y) });
    const shown = known && found && !lost;
    const [x1, y1] = shown ? cm(found.pose) : [0, 0];
    const [dx, dy] = shown ? polar(COMMAND_CM, heading) : [0, 0];
    see('commanded', shown, { x1: r(x1), y1: r(y1), x2: r(x1 + dx), y2: r(y1 + dy) });
  }

  function obstacles() {
    html('obstacles', view.obstacles.map(([x, y, length, width, angle, round]) => {
      const [l, w] = [100 * length, 100 * width];
      return `<g transform="${move([x, y])} ${rotate(angle)}">${round ? `<circle r="${r(l / 2)}"/>` : `<rect x="${r(-l / 2)}" y="${r(-w / 2)}" width="${r(l)}" height="${r(w)}"/>`}</g>`;
    }).join(''));
  }

  function behaviors() {
    const { behaviors: found, estimate: at, lost } = view;
    find('behaviors-part').hidden = !found.length;
    html('behaviors', found.map(([name, angle, said, heard]) => `<li class="${heard ? 'heard' : ''}"><b>${name}</b> <span>${said}</span> <i>${angle === null ? '' : degrees(angle, 0)}</i></li>`).join(''));
    const aimed = at && !lost ? found.filter(([, angle]) => angle !== null) : [];
    html('proposals', aimed.map(([, angle, , heard]) => `<g transform="${move(at.pose)}">${arrow(heard ? 'heard' : 'unheard', angle, 46)}</g>`).join(''));
  }

  // The figures stay below the sets' upper edge, clear of the labels; where two sets share the
  // value, one stands on its left and one on its right.
  function region() {
    const { region: now } = view;
    text('region', now ? `in ${now.name}` : '–');
    text('confidence', now ? now.confidence : '–');
    for (const axis of [0, 1]) {
      const active = now ? now.mu[axis].map((share, n) => [n, share]).filter(([, share]) => share > 0) : [];
      const x = now ? abscissa(now.at[axis], view.arena.knots[axis]) : 0;
      html(`values-${'xy'[axis]}`, (now ? `<path class="now" d="M${r(x)} 16V74"/>` : '') + active.map(([n, share], k) => {
        const right = active.length > 1 ? k === active.length - 1 : x < 200;
        const y = 74 - 54 * share;
        return `<circle class="mu set-${n % 3}" cx="${r(x)}" cy="${r(y)}" r="5"/><text class="mu" data-testid="mu-${'xy'[axis]}-${n}" x="${r(x + (right ? 9 : -9))}"`
          + ` y="${r(Math.min(71, Math.max(35, y + 4)))}" text-anchor="${right ? 'start' : 'end'}">${fixed(share, 2)}</text>`;
      }).join(''));
    }
  }

  function picture() {
    see('image', view.picture);
    if (!view.picture) { html('detections', ''); return; }
    const { url, size: [width, height], leds } = view.picture;
    set('camera', { viewBox: `0 0 ${width} ${height}` });
    set('image', { href: url, width, height });
    text('camera-note', leds.length ? `${leds.filter(Boolean).length} of ${leds.length} LEDs` : view.arena.leds.length ? 'no detections received' : 'tags are not drawn');
    // The window is the smallest in which the localizer tracks an LED.
    html('detections', leds.map((led, n) => (led ? `<g data-testid="detection-${n + 1}"><rect x="${r(led[0] - 20)}" y="${r(led[1] - 20)}" width="40" height="40"/>`
      + `<text x="${r(Math.min(width - 36, Math.max(36, led[0])))}" y="${r(Math.max(led[1] - 28, 20))}">LED ${n + 1}</text></g>` : '')).join(''));
  }

  // What a planner takes for floor, and walls where it felt them: the body's radius before its centre.
  function model() {
    const known = view.model;
    find('model-row').hidden = !known;
    if (!known) { html('model', ''); return; }
    const { walls, spans_m: [columns, rows], entered } = known;
    const been = new Set(entered.map(([region]) => region.join()));
    const places = columns.flatMap(([i, [x0, x1]]) => rows.map(([j, [y0, y1]]) => [been.has(`${i},${j}`), cm([x0, y1]), cm([x1, y0])]));
    const corners = [columns, rows].map((axis) => axis.flatMap(([, span]) => span));
    const [[left, right], [near, far]] = corners.map((all) => [Math.min(...all), Math.max(...all)]);
    const line = ([ux, uy, limit]) => {
      const along = [left, right].flatMap((x) => [near, far].map((y) => x * -uy + y * ux));
      const gap = limit + view.arena.body_m;
      const ends = [Math.min(...along), Math.max(...along)].map((t) => cm([ux * gap - uy * t, uy * gap + ux * t]).map(r).join(' '));
      return `<path class="felt" data-testid="felt-wall" d="M${ends.join('L')}"/>`;
    };
    html('model', places.map(([entry, [x0, y0], [x1, y1]]) => `<rect class="${entry ? 'known' : 'imagined'}" x="${r(x0)}" y="${r(y0)}" width="${r(x1 - x0)}" height="${r(y1 - y0)}"/>`).join('') + walls.map(line).join(''));
    const count = (number, name) => `${number} ${name}${number === 1 ? '' : 's'}`;
    text('model-text', `${count(walls.length, 'wall')} felt, ${count(places.filter(([entry]) => entry).length, 'region')}, ${places.filter(([entry]) => !entry).length} imagined`);
  }

  function learning() {
    const { last, outcomes, curve } = view;
    const total = Object.values(outcomes).reduce((a, b) => a + b, 0);
    text('success', total ? `${outcomes.goal || 0} of ${total}` : '–');
    text('bumps', String(outcomes.bump || 0));
    text('timeouts', String(outcomes.timeout || 0));
    text('learning-note', view.learning ? 'in progress' : 'policy is fixed');
    text('trial', last ? String(last.trial) : '–');
    text('temperature', last ? (last.temperature > 0 ? String(Number(last.temperature.toPrecision(3))) : 'greedy') : '–');
    text('last-action', last ? `${degrees(last.heading, 0)} in ${last.region}${last.outcome ? `, ${last.outcome}` : ''}` : '–');
    const [first, end] = curve.length ? [curve[0][0], curve.at(-1)[0]] : [1, 1];
    const points = curve.map(([n, share]) => [34 + (358 * (n - first)) / Math.max(1, end - first), 88 - 78 * share]);
    set('curve-line', { points: points.map(([x, y]) => `${r(x)},${r(y)}`).join(' ') });
    html('curve-dots', points.slice(-1).map(([x, y]) => `<circle cx="${r(x)}" cy="${r(y)}" r="3.5"/>`).join(''));
    html('curve-axes', '<path class="axis" d="M34 10V88H392"/><path class="grid" d="M34 10H392"/><text class="knot end" x="30" y="14">100 %</text><text class="knot end" x="30" y="88">0</text>'
      + `<text class="knot start" x="34" y="104">path ${first}</text><text class="knot end" x="392" y="104">${end}</text><text class="label" x="213" y="104">goals among the last ${WINDOW} paths</text>`);
  }

  function summary() {
    const { status, mode, path, time_s: time, speed, clock } = view;
    const tone = status.includes('silent') ? 'down' : ['driving', 'learning'].includes(status) ? 'up' : 'quiet';
    if (!page.is('ended')) {
      text('status', status);
      find('status').className = `chip ${tone}`;
    }
    text('mode', view.learning ? 'learning' : mode ?? '–');
    text('path', path === null ? '–' : String(path));
    text('sim-time', time ? `${time.toFixed(1)} s` : '–');
    text('speed', clock === 'lockstep' ? 'lockstep' : speed ? `${speed}×` : '–');
    const paused = status === 'paused';
    text('pause', paused ? 'Resume' : 'Pause');
    find('step').disabled = !paused;
    // In lockstep nothing would wait for a recorder that joins later.
    find('record').disabled = clock === 'lockstep';
    find('record').title = clock === 'lockstep' ? 'in lockstep, start the run with --record' : '';
    for (const [name, value, off] of [['mode', mode, view.learning], ['speed', speed, clock === 'lockstep'], ['noise', view.noise, false]]) {
      const choice = find(`${name}-choice`);
      choice.disabled = off;
      for (const radio of choice.querySelectorAll('input')) radio.checked = radio.value === String(value);
    }
  }

  function nodes() {
    for (const [name, [status, word]] of Object.entries(view.nodes)) {
      find(`node-${name}`).className = `node ${page.is('ended') ? 'ended' : status}`;
      text(`word-${name}`, page.is('ended') ? 'ended' : word);
    }
  }

  function robots() {
    find('robots').hidden = view.robots.length < 2;
    find('robot-choice').replaceChildren(...view.robots.map((name) => make('option', { value: name }, name || '/')));
    find('robot-choice').value = view.robot;
  }

  const painters = [
    [['arena'], floor],
    [['truth', 'camera', 'fov', 'bumpers', 'seen', 'lost', 'arena'], robot],
    [['estimate', 'stamp', 'lost', 'arena'], estimate],
    [['odometry', 'error', 'compared', 'arena'], odometry],
    [['trail'], () => set('trail', { points: view.trail })],
    [['estimate_trail'], () => set('estimate-trail', { points: view.estimate_trail })],
    [['policy', 'votes', 'arena'], policy],
    [['policy', 'arena'], values],
    [['votes', 'heading', 'note', 'estimate', 'last', 'lost'], decision],
    [['region', 'arena'], region],
    [['obstacles', 'arena'], obstacles],
    [['behaviors', 'estimate', 'lost'], behaviors],
    [['picture'], picture],
    [['last', 'outcomes', 'curve', 'learning'], learning],
    [['model', 'arena'], model],
    [['status', 'mode', 'path', 'time_s', 'speed', 'clock', 'noise', 'learning'], summary],
    [['nodes'], nodes],
    [['robot', 'robots'], robots],
    [['topics'], () => html('topics', view.topics.map(([topic, rate]) => `<li><span>${topic}</span><b>${r(rate)}</b></li>`).join(''))],
  ];

  return {
    // A difference holds new values by name; '+name' appends to a text.
    apply(difference) {
      const changed = new Set();
      for (const [key, value] of Object.entries(difference)) {
        const name = key.replace('+', '');
        view[name] = key[0] === '+' ? view[name] + value : value;
        changed.add(name);
      }
      for (const [names, paint] of painters) if (names.some((name) => changed.has(name))) paint();
      return changed;
    },
    ended() { nodes(); },
    view: () => view,
  };
}
