import { useState } from 'react'
import type { Field, JsonSchema } from '../schema/jsonSchema'
import { formFields, inputOf, inputsOf, keyOf, messageOf, type Input, type Inputs } from './messageForm'
import { checkedJson, templateOf, unsaidNumbers, type Checked } from './template'

/** A message that a person is about to send, as a form or as JSON text. */
export interface MessageDraft {
  /** The fields of the form; null while it is text. */
  readonly fields: readonly Field[] | null
  /** Whether the schema allows a form at all. */
  readonly hasForm: boolean
  readonly text: string
  readonly inputOf: (field: Field) => Input
  readonly type: (text: string) => void
  readonly fill: (field: Field, input: Input) => void
  /** To text and back; what was entered goes along, as far as it can. */
  readonly turn: () => void
  /** The message as it will be sent, or what is wrong with it. */
  readonly checked: Checked
}

/** A zero may be a place to which something goes. */
const MADE_UP = 'The zeros stand for numbers that nobody has said; change what is meant'

/**
 * Holds what a person enters. Until then the schema says with what it begins, also one that is learned later. What is not
 * JSON is text of any kind.
 */
export function useMessageDraft(schema: JsonSchema | undefined, isJson = true): MessageDraft {
  const [inputs, setInputs] = useState<Inputs>({})
  const [typed, setTyped] = useState<string | null>(null)
  const [isText, setIsText] = useState(false)
  const possible = isJson ? formFields(schema) : null
  const fields = isText ? null : possible
  const text = typed ?? (isJson ? templateOf(schema) : '')
  const isMadeUp = typed === null && isJson && unsaidNumbers(schema)
  const checkedText: Checked = !isJson ? { ok: true, text } : isMadeUp ? { ok: false, problem: MADE_UP } : checkedJson(text)

  const turn = () => {
    const entered = fields === null ? null : messageOf(fields, inputs)
    if (entered?.ok === true) setTyped(JSON.stringify(entered.value, null, 2))
    if (fields === null && possible !== null && checkedText.ok && typed !== null) setInputs(inputsOf(possible, JSON.parse(checkedText.text)))
    setIsText(!isText)
  }
  return {
    fields,
    hasForm: possible !== null,
    text,
    inputOf: (field) => inputs[keyOf(field)] ?? inputOf(field, field.initial),
    type: setTyped,
    fill: (field, input) => setInputs((before) => ({ ...before, [keyOf(field)]: input })),
    turn,
    checked: fields === null ? checkedText : checkedForm(fields, inputs),
  }
}

function checkedForm(fields: readonly Field[], inputs: Inputs): Checked {
  const read = messageOf(fields, inputs)
  return read.ok ? { ok: true, text: JSON.stringify(read.value) } : read
}
