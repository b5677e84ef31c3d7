// Applies patches of the view to the page's elements, which carry their names as data-testid.
// A patch is {name: {attribute: value}}; 'text' and 'html' are the content, '+name' appends.
// The page asks for the next patch when it has painted the last one: a hidden page asks for none.
export default {
  template: '<div class="live" ref="root" v-once v-html="skeleton"></div>',
  props: { skeleton: String },
  mounted() {
    this.elements = new Map();
    for (const element of this.$refs.root.querySelectorAll('[data-testid]')) {
      this.elements.set(element.dataset.testid, element);
    }
    const arena = this.elements.get('arena');
    arena.addEventListener('pointerdown', (event) => this.press(event));
    arena.addEventListener('pointerup', (event) => this.release(event));
    window.socket?.on('disconnect', () => this.mark('lost', true));
    window.socket?.on('connect', () => this.mark('lost', false));
    this.painted = performance.now();
    this.asked = setInterval(() => this.remind(), 1500);
    this.$emit('next', true);
  },
  unmounted() {
    clearInterval(this.asked);
  },
  methods: {
    // A patch can be lost with a connection: ask for everything after three seconds without one.
    remind() {
      if (!document.hidden && performance.now() - this.painted > 3000) this.$emit('next', true);
    },
    apply(patch) {
      this.painted = performance.now();
      for (const [name, changes] of Object.entries(patch)) {
        const element = this.elements.get(name);
        if (!element) continue;
        for (const [key, value] of Object.entries(changes)) this.change(element, key, value);
      }
      requestAnimationFrame(() => this.$emit('next', false));
    },
    change(element, key, value) {
      if (key === 'text') element.textContent = value;
      else if (key === 'html') element.innerHTML = value;
      else if (key[0] === '+') {
        const name = key.slice(1);
        element.setAttribute(name, (element.getAttribute(name) || '') + value);
      } else element.setAttribute(key, value);
    },
    mark(name, on) {
      document.body.classList.toggle(name, on);
    },
    place(event) {
      const arena = this.elements.get('arena');
      const point = new DOMPoint(event.clientX, event.clientY);
      return point.matrixTransform(arena.getScreenCTM().inverse());
    },
    press(event) {
      if (!document.body.classList.contains('placing')) return;
      event.preventDefault();
      this.pressed = this.place(event);
    },
    release(event) {
      if (!document.body.classList.contains('placing') || !this.pressed) return;
      const [from, to] = [this.pressed, this.place(event)];
      this.pressed = null;
      this.$emit('place', { x: from.x, y: from.y, dx: to.x - from.x, dy: to.y - from.y });
    },
  },
};
