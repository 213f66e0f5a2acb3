// How the page and its session speak: over a WebSocket of this machine, or through the window around a frame.

const HEADER = 4; // bytes of the length of a message's JSON

/** A message of the session: its JSON object, and the bytes of a recording if there is one. */
function decoded(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const content = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, HEADER, length)));
  const rest = buffer.slice(HEADER + length);
  return { ...content, recording: rest.byteLength ? rest : null };
}

/** Connect; `onMessage(message)` and `onEnd(text)` are called. Returns the function that sends an object. */
export function connect(onMessage, onEnd) {
  return location.protocol === "http:" ? bySocket(onMessage, onEnd) : byWindow(onMessage);
}

function bySocket(onMessage, onEnd) {
  const socket = new WebSocket(`ws://${location.host}${location.pathname}/socket`);
  socket.binaryType = "arraybuffer";
  socket.addEventListener("message", ({ data }) => onMessage(decoded(data)));
  socket.addEventListener("close", ({ reason }) =>
    onEnd(reason ? `The connection is closed: ${reason}.` : "The program has ended. Start it again, and open its new address."),
  );
  return (message) => socket.readyState === WebSocket.OPEN && socket.send(JSON.stringify(message));
}

function byWindow(onMessage) {
  addEventListener("message", ({ source, data }) => {
    if (source === parent && data instanceof ArrayBuffer) onMessage(decoded(data));
  });
  const send = (message) => parent.postMessage(JSON.stringify(message), "*");
  send({ do: "open" });
  return send;
}
