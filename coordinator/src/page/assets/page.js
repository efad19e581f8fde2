'use strict';
// Renews the page's parts with what the coordinator sends. Without this script the page is complete, and reloaded.

const connection = document.getElementById('connection');
const build = document.documentElement.dataset.build;
const RETRY_MS = 5000;

function say(text, state) {
  // Unchanged text is not written again: a screen reader would say it again.
  if (connection.textContent !== text) connection.textContent = text;
  connection.className = 'connection ' + state;
}

function renew(parts) {
  for (const [name, html] of Object.entries(parts)) {
    if (name === 'title') {
      const text = document.createElement('textarea');
      text.innerHTML = html;
      document.title = text.value;
      continue;
    }
    const element = document.getElementById(name);
    if (element) element.innerHTML = html;
  }
}

function connect() {
  const events = new EventSource('events');
  let ended = false;
  let lost = false;
  events.addEventListener('hello', (event) => {
    // Another version has taken over: its page may be another one.
    if (event.data !== build) location.reload();
    ended = lost = false;
    say('live', 'live');
  });
  events.addEventListener('parts', (event) => renew(JSON.parse(event.data)));
  events.addEventListener('end', () => { ended = true; });
  events.onerror = () => {
    const now = new Date().toLocaleTimeString();
    if (ended) say('the coordinator has ended; this is its last state', 'ended');
    else if (!lost) say('no connection since ' + now + '; trying again', 'lost');
    lost = true;
    // A browser gives up where it was answered with an error.
    if (events.readyState === EventSource.CLOSED) setTimeout(connect, RETRY_MS);
  };
}

connect();
