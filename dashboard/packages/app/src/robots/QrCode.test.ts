import { expect, test } from 'vitest'
import { isOwnMachine } from './QrCode'

test.each(['localhost', 'a.localhost', '127.0.0.1', '127.1.2.3', '[::1]'])('%s is this very machine', (name) => {
  expect(isOwnMachine(name)).toBe(true)
})

test.each(['mosaic.example.org', '10.0.0.7', 'localhost.example.org', '[fe80::1]'])('%s is reached from elsewhere', (name) => {
  expect(isOwnMachine(name)).toBe(false)
})
