// Applies differences of the view to the page's elements, which carry their names as data-testid.
// A difference is {name: {attribute: value}}; 'text' and 'html' are the content, '+name' appends.
// The page asks for the next difference when it has painted the last: a hidden page asks for none.
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
    window.socket?.on('disconnect', () => this.toggleClass('lost', true));
    window.socket?.on('connect', () => this.toggleClass('lost', false));
    this.painted = performance.now();
    this.watchdog = setInterval(() => this.checkConnection(), 1500);
    this.$emit('next', true);
  },
  unmounted() {
    clearInterval(this.watchdog);
  },
  methods: {
    // A difference can be lost with a connection: after three seconds without one, request the
    // whole view.
    checkConnection() {
      if (!document.hidden && performance.now() - this.painted > 3000) this.$emit('next', true);
    },
    apply(difference) {
      this.painted = performance.now();
      for (const [name, changes] of Object.entries(difference)) {
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
    toggleClass(name, on) {
      document.body.classList.toggle(name, on);
    },
    pictureCoordinates(event) {
      const arena = this.elements.get('arena');
      const point = new DOMPoint(event.clientX, event.clientY);
      return point.matrixTransform(arena.getScreenCTM().inverse());
    },
    press(event) {
      if (!document.body.classList.contains('placing')) return;
      event.preventDefault();
      this.pressed = this.pictureCoordinates(event);
    },
    release(event) {
      if (!document.body.classList.contains('placing') || !this.pressed) return;
      const [from, to] = [this.pressed, this.pictureCoordinates(event)];
      this.pressed = null;
      this.$emit('place', { x: from.x, y: from.y, dx: to.x - from.x, dy: to.y - from.y });
    },
  },
};
