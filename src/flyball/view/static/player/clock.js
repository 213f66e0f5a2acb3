// Model time: playing, looping, speed.

export class Clock {
  /** A clock over a span of model time; `onChange` is called after every change of time or state. */
  constructor(begin, end, onChange) {
    Object.assign(this, { begin, end, onChange, time: begin, playing: false, looping: true, speed: 1, before: null });
    Object.assign(this, { origin: 0, scale: 1 }); // of the times that are shown
  }

  /** Go round within a part of the time; times count from its begin, multiplied by a scale (none are shown for 0). */
  within(begin, end, scale) {
    const part = (this.time - this.begin) / (this.end - this.begin);
    Object.assign(this, { begin, end, scale, origin: begin });
    this.seek(begin + part * (end - begin));
  }

  /** Another span of time; go to a time, or stay as far as possible. */
  restrict(begin, end, time = this.time) {
    Object.assign(this, { begin, end });
    this.seek(time);
  }

  get still() {
    return !(this.end > this.begin);
  }

  seek(time) {
    this.time = Math.min(Math.max(Number.isFinite(time) ? time : this.begin, this.begin), this.end);
    this.onChange();
  }

  play(on = true) {
    this.playing = on && !this.still;
    this.before = null;
    if (this.playing && this.time >= this.end) this.time = this.begin;
    if (this.playing) this.onPlay?.();
    this.onChange();
  }

  /** Advance to a wall time [ms]. A long pause (a hidden tab) counts as one short step. */
  tick(now) {
    if (!this.playing) return;
    const passed = this.before === null ? 0 : Math.min(now - this.before, 250) / 1000;
    this.before = now;
    let time = this.time + this.speed * passed;
    if (time >= this.end && this.looping) time = this.begin + ((time - this.begin) % (this.end - this.begin));
    if (time >= this.end) this.playing = false;
    this.seek(time);
  }
}
