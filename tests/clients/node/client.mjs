// tuio-client on UDP; see ../process_client.py for what this writes and reads.

const say = (...words) => process.stdout.write(JSON.stringify(words) + '\n');

const { default: OSC, Tuio11Client, TuioReceiver } = await packages();

async function packages() {
  try {
    return { ...(await import('osc-js')), ...(await import('tuio-client/dist/tuio-client.es.js')) };
  } catch (error) {
    say('missing', `tuio-client is not installed (${error.message}): npm ci in tests/clients/node`);
    process.exit();
  }
}

// What tuio-client's documentation shows for a WebSocket, with osc-js's plugin for UDP in its place.
class UdpReceiver extends TuioReceiver {
  constructor(port) {
    super();
    this.port = port;
    this.osc = new OSC({ plugin: new OSC.DatagramPlugin() });
    this.osc.on('*', (message) => this.onOscMessage(message));
    this.osc.on('error', (error) => {
      say('fault', `osc-js: ${error.message}`);
      if (!this.isConnected) process.exit(1);
    });
    this.osc.on('open', () => {
      this.isConnected = true;
      say('ready');
    });
  }

  connect() {
    this.osc.open({ host: '127.0.0.1', port: this.port });
  }

  disconnect() {
    this.osc.close();
    this.isConnected = false;
  }
}

const client = new Tuio11Client(new UdpReceiver(Number(process.argv[2])));
client.addTuioListener({
  addTuioCursor: (cursor) => say('add', cursor.sessionId, cursor.position.x, cursor.position.y),
  updateTuioCursor: (cursor) => say('move', cursor.sessionId, cursor.position.x, cursor.position.y),
  removeTuioCursor: (cursor) => say('remove', cursor.sessionId),
  refresh: () => {},
});
client.connect();

process.stdin.setEncoding('utf8');
process.stdin.on('data', (pings) => pings.split('\n').filter(Boolean).forEach((number) => say('pong', Number(number))));
process.stdin.on('end', () => process.exit());
