import { expect, test } from 'vitest'
import { bufferTargetMs, readPictureChoices, writePictureChoices } from './pictureChoices'

const holding = (text: string | null) => ({ getItem: () => text })

test('pictures are for driving, unless somebody chose otherwise', () => {
  expect(readPictureChoices(holding(null), 'r', 'front')).toEqual({ buffering: 'drive', showsDetails: false, showsMarks: true })
  expect(bufferTargetMs('drive')).toBe(0)
  expect(bufferTargetMs('auto')).toBeNull()
})

test('a choice is remembered per robot and label', () => {
  const kept = new Map<string, string>()
  writePictureChoices({ setItem: (key, value) => void kept.set(key, value) }, 'r', 'front', { buffering: 'inspect', showsDetails: true, showsMarks: false })
  const storage = { getItem: (key: string) => kept.get(key) ?? null }
  expect(readPictureChoices(storage, 'r', 'front')).toEqual({ buffering: 'inspect', showsDetails: true, showsMarks: false })
  expect(readPictureChoices(storage, 'r', 'rear').buffering).toBe('drive')
})

test.each(['nonsense', 'null', '7', '{"buffering":"x","showsDetails":1}'])('%s in the storage is no choice', (text) => {
  expect(readPictureChoices(holding(text), 'r', 'front')).toEqual({ buffering: 'drive', showsDetails: false, showsMarks: true })
})
