import { describe, expect, test } from 'vitest'
import { plainText } from '../src/plainText'

describe('plain text', () => {
  test('keeps what people write, in any script', () => {
    for (const text of ['', 'Anna', 'ルンバ 3', 'مرحبا', '👩🏽‍🔧 workshop', 'a\u00a0b']) expect(plainText(text)).toBe(text)
  })

  test('is one line without orders to a terminal, marks of direction and what is not seen', () => {
    expect(plainText('a\r\n\tb\u2028c')).toBe('a   b c')
    expect(plainText('\u001b[31mred\u0007')).toBe('\ufffd[31mred\ufffd')
    expect(plainText('\u202etxt.exe\u2066')).toBe('\ufffdtxt.exe\ufffd')
    expect(plainText('An\u200bn\ufeffa')).toBe('Anna')
  })

  test('carries nothing that is not seen, and keeps the joiners that writing needs', () => {
    for (const hidden of ['\u{e0041}', '\u{e0100}', '\u{e0fff}', '\u{1d173}', '\u034f', '\u3164', '\ufff8', '\ufe00', '\u00ad'])
      expect(plainText(`An${hidden}na${hidden}`)).toBe('Anna')
    for (const text of ['❤\ufe0f', 'می\u200cخواهم', 'क्\u200dष']) expect(plainText(text)).toBe(text)
  })

  test('is the same when it is read again', () => {
    const all = String.fromCharCode(...Array.from({ length: 0x2100 }, (_, code) => code))
    expect(plainText(plainText(all))).toBe(plainText(all))
    expect(plainText(all).length).toBeLessThanOrEqual(all.length)
  })
})
