// What the page knows of one flight, from board messages: those of a live one add up, those of a recording replace.

const KEPT_S = 32, SAMPLES_KEPT = 160, EVENTS_KEPT = 40;

export class Flight {
  constructor(place = 0, name = "", recorded = false) {
    Object.assign(this, { place, name, recorded, heardAt: 0, missing: "", latest: null, timeMs: 0 });
    this.clear();
  }

  clear() {
    Object.assign(this, { heads: {}, points: [], decisions: [], samples: new Map(), events: [], broken: null, brokenAt: -1e9, repaired: "", tapeDirty: true });
  }

  // The element of this flight: the first one has the page's own, others have copies.
  at(id) { return document.getElementById(this.place ? `${id}@${this.place}` : id); }

  get plant() { return (this.heads.transmitter || this.heads.receiver)?.plant; }

  // Newest rows: of a recording, those at the cursor.
  get point() { return this.latest ? this.latest.point : this.points.at(-1); }
  get decision() { return this.latest ? this.latest.decision : this.decisions.at(-1); }

  // Time that a broken lockstep stays visible by, in ms: of a recording, flight time.
  get now() { return this.recorded ? this.timeMs : performance.now(); }

  take(news) {
    if (!news.heads) return;
    if (news.reset) {
      const { points, decisions } = this;
      this.clear();
      // Of a recording, curves come anew only where the cursor left them.
      if (!news.points) Object.assign(this, { points, decisions });
    }
    if (news.at_s !== undefined) {
      this.timeMs = news.at_s * 1000;
      this.latest = { point: news.point, decision: news.decision };
    }
    Object.assign(this.heads, news.heads);
    this.points.push(...news.points || []);
    this.decisions.push(...news.decisions || []);
    for (const sample of news.samples) this.samples.set(sample[0], sample);
    while (this.samples.size > SAMPLES_KEPT) this.samples.delete(this.samples.keys().next().value);
    this.tapeDirty ||= news.samples.length > 0 || Boolean(news.reset);
    for (const event of news.events) this.happened(event, news.reset);
    if (Object.keys(news.heads).length) this.heardAt = performance.now();
  }

  happened(event, old) {
    const { role, kind } = event;
    if (role === "transmitter" && kind === "desync") {
      if (this.recorded) this.brokenAt = event.time_s * 1000;
      else if (!old) this.brokenAt = performance.now();
      this.broken = event;
      this.repaired = "";
    }
    if (role === "transmitter" && kind === "rejoin" && this.broken) {
      this.repaired = `broken after sample ${this.broken.sample}, at ${this.broken.time_s.toFixed(1)} s; equal again from sample ${event.sample}`;
    }
    if (this.events[0] && same(this.events[0], event)) return;
    this.events.unshift(event);
    this.events.length = Math.min(this.events.length, EVENTS_KEPT);
  }

  // Of a live flight: leaves out what no curve shows any more; returns the newest time.
  forget() {
    const now = this.points.at(-1)?.[0] ?? 0;
    for (const rows of [this.points, this.decisions]) {
      let old = 0;
      while (old < rows.length && rows[old][0] < now - KEPT_S) old++;
      if (old > 20) rows.splice(0, old);
    }
    return now;
  }

  lastCompared() {
    let found = null;
    for (const sample of this.samples.values()) if (sample[3] && sample[4] && (!found || sample[0] > found[0])) found = sample;
    return found;
  }
}

// Repetitions of one event differ in their time and sample alone.
function same(one, other) {
  const names = new Set([...Object.keys(one), ...Object.keys(other)]);
  return [...names].every((name) => ["time_s", "sample", "text"].includes(name) || one[name] === other[name]);
}
