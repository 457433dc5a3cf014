// Passes touchd's datagrams on to browsers: each becomes one binary WebSocket message. It also serves page.html.
//
// npm install ws; then: node bridge.mjs [UDP_PORT [HTTP_PORT]] and open http://localhost:8080

import { createSocket } from "node:dgram";
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { WebSocketServer } from "ws";

const udpPort = Number(process.argv[2] ?? 3333);
const httpPort = Number(process.argv[3] ?? 8080);
const mostWaitingBytes = 65536; // a browser that does not keep up misses frames instead of getting late ones

const pageServer = createServer(async (request, response) => {
  if (request.url !== "/") {
    response.writeHead(404).end();
    return;
  }
  const page = await readFile(new URL("page.html", import.meta.url));
  response.writeHead(200, { "Content-Type": "text/html; charset=utf-8" }).end(page);
});

const browsers = new WebSocketServer({ server: pageServer });
const tuio = createSocket("udp4");
tuio.on("message", (datagram) => {
  for (const browser of browsers.clients) {
    if (browser.bufferedAmount < mostWaitingBytes) browser.send(datagram, { binary: true });
  }
});

tuio.bind(udpPort);
pageServer.listen(httpPort, "127.0.0.1", () => {
  console.log(`TUIO on UDP port ${udpPort} to http://localhost:${httpPort}`);
});
