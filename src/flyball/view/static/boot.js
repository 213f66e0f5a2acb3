// Unpacks the player and the recording, both gzipped in the page, and starts the one on the other.
(async () => {
  const fail = (error) => {
    const box = document.querySelector(".message");
    const old = typeof DecompressionStream === "undefined";
    box.textContent = old
      ? "This page needs a newer browser (2023 or later)."
      : `The page could not start: ${error.message}`;
    box.hidden = false;
    if (!old) throw error;
  };
  const unpack = (id) => {
    const bytes = Uint8Array.from(atob(document.getElementById(id).textContent), (c) => c.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
  };
  try {
    const script = document.createElement("script");
    script.textContent = new TextDecoder().decode(await unpack("player"));
    document.head.append(script);
    if (document.getElementById("recording").textContent) window.startPlayer(await unpack("recording"));
    else window.startLive();
  } catch (error) {
    fail(error);
  }
})();
