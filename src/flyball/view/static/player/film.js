// The animation as a file: a video that the browser records, or a GIF of single pictures.
import { GIFEncoder, applyPalette, quantize } from "gifenc";

const FRAMES = 30; // a second of video
const TYPES = ["video/mp4;codecs=avc1.42E01F", "video/mp4", "video/webm;codecs=vp9", "video/webm"];
const GIF = { rate: 20, most: 400, width: 640 }; // pictures a second, of all, px
const COLOURS = 256;

/** The format of videos that the browser records: type and ending; null where it records none. */
export function videoFormat() {
  if (typeof MediaRecorder === "undefined") return null;
  const type = TYPES.find((one) => MediaRecorder.isTypeSupported(one));
  return type ? { type, ending: type.startsWith("video/mp4") ? "mp4" : "webm" } : null;
}

/** A canvas on which the picture of a stage is copied, with its ground. */
export class Copy {
  constructor(stage, ground, width = Infinity) {
    this.from = stage.element.querySelector("canvas");
    const scale = Math.min(1, width / this.from.width);
    this.canvas = document.createElement("canvas");
    const even = (x) => 2 * Math.floor((scale * x) / 2);
    Object.assign(this.canvas, { width: even(this.from.width), height: even(this.from.height) });
    this.pen = this.canvas.getContext("2d", { willReadFrequently: width < Infinity });
    this.ground = ground;
  }

  /** Copy the picture; to be called in the frame in which it was drawn. */
  take() {
    const { width, height } = this.canvas;
    this.pen.fillStyle = this.ground;
    this.pen.fillRect(0, 0, width, height);
    this.pen.drawImage(this.from, 0, 0, width, height);
  }

  get pixels() {
    return this.pen.getImageData(0, 0, this.canvas.width, this.canvas.height).data;
  }
}

/** Record the animation once from its begin to its end, at its speed; returns what ends it early. */
export function recordVideo({ picture, clock }, ground, { type }, onEnd) {
  const copy = new Copy(picture.stage, ground);
  const recorder = new MediaRecorder(copy.canvas.captureStream(FRAMES), { mimeType: type, videoBitsPerSecond: 8e6 });
  const parts = [];
  const { looping } = clock;
  recorder.ondataavailable = ({ data }) => parts.push(data);
  recorder.onstop = () => {
    Object.assign(clock, { looping });
    picture.onFrame = null;
    onEnd(new Blob(parts, { type: type.split(";")[0] }));
  };
  const stop = () => recorder.state !== "inactive" && recorder.stop();
  clock.looping = false;
  clock.seek(clock.begin);
  picture.onFrame = (drawn) => {
    if (drawn) copy.take();
    if (!clock.playing) setTimeout(stop, 1000 / FRAMES); // the last frame is part of it
  };
  recorder.start();
  clock.play();
  return stop;
}

/** Draw the animation once from its begin to its end, picture by picture; returns what ends it early. */
export function drawGif({ picture, clock }, ground, onEnd) {
  const { stage, mechanism } = picture;
  const copy = new Copy(stage, ground, GIF.width * Math.min(window.devicePixelRatio, 2));
  const { width, height } = copy.canvas;
  const seconds = (clock.end - clock.begin) / clock.speed;
  const count = Math.max(2, Math.min(Math.round(GIF.rate * seconds), GIF.most));
  const delay = (1000 * seconds) / count;
  const gif = GIFEncoder();
  const time = clock.time;
  let stopped = false;
  clock.play(false);
  const next = (k) => {
    if (stopped || k === count) {
      clock.seek(time);
      gif.finish();
      return onEnd(new Blob([gif.bytes()], { type: "image/gif" }));
    }
    mechanism.seek(clock.begin + ((clock.end - clock.begin) * k) / (count - 1));
    stage.dirty = true;
    stage.draw(performance.now());
    copy.take();
    const { pixels } = copy;
    const palette = quantize(pixels, COLOURS);
    gif.writeFrame(applyPalette(pixels, palette), width, height, { palette, delay });
    setTimeout(next, 0, k + 1);
  };
  setTimeout(next, 0, 0);
  return () => (stopped = true);
}
