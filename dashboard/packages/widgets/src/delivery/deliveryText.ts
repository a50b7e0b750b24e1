import { reasonOf, type Delivery, type DeliveryRow } from '@mosaic/client'

/** What each delivery promises, in a few words. */
export const PROMISES: Record<Delivery, string> = {
  reliable: 'ordered and complete',
  latest: 'the newest value only',
  bulk: 'behind everything else',
}

/** `1.5 KB`. */
export function sizeText(bytes: number): string {
  if (bytes < 1000) return `${Math.round(bytes)} B`
  if (bytes < 1e6) return `${(bytes / 1e3).toFixed(1)} KB`
  return `${(bytes / 1e6).toFixed(1)} MB`
}

/** `10.0/s · 1.5 KB/s`. */
export function rateText({ rateHz, bytesPerS }: { rateHz: number; bytesPerS: number }): string {
  return `${rateHz.toFixed(1)}/s · ${sizeText(bytesPerS)}/s`
}

/** `3 · 1.5 KB`; a dash where nothing waits. */
export function queueText(messages: number, bytes: number): string {
  return messages === 0 ? '–' : `${messages} · ${sizeText(bytes)}`
}

/** `It fails (plugin.no_device): The connector's device … Next try in 8 s.`; nothing where it does not. */
export function failureText({ failureCode, triesAgainInS }: Pick<DeliveryRow, 'failureCode' | 'triesAgainInS'>): string {
  if (failureCode === undefined) return ''
  const next = triesAgainInS === undefined ? '' : ` Next try in ${Math.ceil(triesAgainInS)} s.`
  return `It fails (${failureCode}): ${reasonOf(failureCode).sentence}${next}`
}
