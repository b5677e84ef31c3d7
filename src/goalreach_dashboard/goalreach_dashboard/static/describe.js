// Pictures in words, for who does not see them, and the error over time.
const EVERY_MS = 2000;
const WINDOW_S = 30;
const LOST_M = 0.5; // a band so wide belongs to a localizer that searches: it sets no scale
const [LEFT, RIGHT, TOP, BOTTOM] = [34, 396, 8, 90];
const points = [];
let shown;
let said = -Infinity;

// Updates the text alternatives at most every two seconds; announces them only when asked.
export function describe(page, aloud) {
  const now = performance.now();
  if (!aloud && now - said < EVERY_MS) return;
  said = now;
  const { text } = page;
  const rows = [...page.find('votes').children].map((row) => row.textContent.replace(/\s+/g, ' ').trim());
  const values = (axis, names) => names.map((name, index) => [name, axis.querySelector(`[data-testid$="-${index}"]`)?.textContent])
    .filter(([, value]) => value).map(([name, value]) => `${name} ${value}`).join(', ');
  const labels = (name) => [...page.find(name).querySelectorAll('.label')].map((each) => each.textContent);
  const last = points.at(-1);
  const texts = {
    arena: `${page.text('status')}. The robot is at ${text('truth-x')}, ${text('truth-y')}, heading ${text('truth-heading')}, ${text('region')}; `
      + `the estimate is off by ${text('error-position')}. Commanded heading ${text('commanded-text')}.`,
    camera: `The camera sees ${text('camera-note')}.`,
    memberships: `x: ${values(page.find('values-x'), labels('sets-x')) || 'unknown'}; y: ${values(page.find('values-y'), labels('sets-y')) || 'unknown'}; ${text('confidence')}.`,
    decision: `${text('decision-note')}. Votes: ${rows.join('; ') || 'none'}. Heading ${text('commanded-text')}.`,
    curve: `${text('success')} paths reached the goal.`,
    error: last ? `Error ${last.error.toFixed(3)} m, 95 % band ${last.band.toFixed(3)} m.` : 'No error known yet.',
  };
  for (const [name, words] of Object.entries(texts)) page.find(`say-${name}`).textContent = words;
  if (aloud) page.find('description').textContent = Object.values(texts).join(' ');
}

export function drawError(page, view) {
  if (!view.error || !view.estimate) return;
  const [time, [error], [band]] = [view.estimate_s, view.error, view.estimate.ellipse];
  if (view.robot !== shown || time < points.at(-1)?.time) points.length = 0;
  shown = view.robot;
  points.push({ time, error, band });
  while (points[0].time < time - WINDOW_S) points.shift();
  const known = points.filter((each) => each.band < LOST_M);
  const largest = Math.max(0.01, ...known.map((each) => Math.max(each.error, each.band)));
  const top = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10].find((step) => step >= largest) ?? largest;
  const x = (each) => (LEFT + ((RIGHT - LEFT) * (each.time - time + WINDOW_S)) / WINDOW_S).toFixed(1);
  const y = (value) => (BOTTOM - (BOTTOM - TOP) * Math.min(1, value / top)).toFixed(1);
  page.find('error-line').setAttribute('points', points.map((each) => `${x(each)},${y(each.error)}`).join(' '));
  const upper = points.map((each) => `${x(each)} ${y(each.band)}`).join('L');
  page.find('error-band').setAttribute('d', `M${upper}L${x(points.at(-1))} ${BOTTOM}L${x(points[0])} ${BOTTOM}z`);
  page.find('error-top').textContent = `${top} m`;
  page.find('error-since').textContent = `-${WINDOW_S} s`;
}
