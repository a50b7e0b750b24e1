import { describe, expect, test } from 'vitest'
import { sortedIceServers, usableIceServers } from '../../src/words/iceServers'

const KNOWN = { username: 'u', credential: 'c' }

test('what a browser takes goes through as it is', () => {
  const urls = ['turn:turn.example.org:3478?transport=udp', 'turns:[2001:db8::1]:5349?transport=tcp', 'turn:198.51.100.7']
  expect(usableIceServers([{ urls: ['stun:stun.example.org'] }, { urls, ...KNOWN }])).toEqual([
    { urls: ['stun:stun.example.org'] },
    ...urls.map((url) => ({ urls: [url], ...KNOWN })),
  ])
})

test('original configurations write host and port, and mean TURN', () => {
  expect(usableIceServers([{ urls: ['turn.example.org:3478'], ...KNOWN }])).toEqual([{ urls: ['turn:turn.example.org:3478'], ...KNOWN }])
})

describe('left out is', () => {
  test.each([{}, { username: 'u' }, { credential: 'c' }, { username: '', credential: '' }])('TURN with %j', (given) => {
    const { usable, unusable } = sortedIceServers([{ urls: ['turn:a', 'stun:a', 'turns:a'], ...given }])
    expect(usable).toEqual([{ urls: ['stun:a'] }])
    expect(unusable.map(({ url, code }) => [url, code])).toEqual([
      ['turn:a', 'ice.turn_no_credentials'],
      ['turns:a', 'ice.turn_no_credentials'],
    ])
  })

  test.each(['stun:', 'turn:a b', 'stun:a?transport=udp', 'turn:a?transport=sctp', 'https://a.example.org', 'turn:a:port', 'turn:u@a', 'turn:a:99999', 'stun:a:0'])('%s', (url) => {
    const { usable, unusable } = sortedIceServers([{ urls: [url], ...KNOWN }])
    expect(usable).toEqual([])
    expect(unusable.map(({ code }) => code)).toEqual(['ice.bad_url'])
  })
})
