// Runs `peers.js` in Node over libdatachannel. Lines of JSON: in `[id, what, method, args]`, out `[id, error, result]`.
// argv: the folder whose node_modules hold node-datachannel.
import { createRequire } from 'node:module'
import { createInterface } from 'node:readline'
import { pathToFileURL } from 'node:url'

const require = createRequire(pathToFileURL(`${process.argv[2]}/`))
const polyfill = require('node-datachannel/polyfill')
Object.assign(globalThis, { RTCPeerConnection: polyfill.RTCPeerConnection })
const { Page, Robot } = await import('./peers.js')
const peers = {}

for await (const line of createInterface({ input: process.stdin })) {
  const [id, what, method, args] = JSON.parse(line)
  answer(id, what, method, args)
}
process.exit(0)

async function answer(id, what, method, args) {
  try {
    if (method === 'new') peers[what] = new { Page, Robot }[args[0]](args[1])
    const result = method === 'new' ? null : await peers[what][method](...args)
    console.log(JSON.stringify([id, null, result ?? null]))
  } catch (error) {
    console.log(JSON.stringify([id, String(error?.stack ?? error), null]))
  }
}
