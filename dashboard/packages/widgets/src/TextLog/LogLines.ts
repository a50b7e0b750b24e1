/** Keeps the last lines of a log; each keeps a number, so that React knows it again. */

export interface LogLine {
  number: number
  text: string
}

const KEPT = 500
/** A line longer than this is cut: one message must not fill the page. */
const MAX_LENGTH = 4000

export class LogLines {
  private lines: readonly LogLine[] = []
  private count = 0

  add(text: string): void {
    const cut = text.length > MAX_LENGTH ? `${text.slice(0, MAX_LENGTH)} …` : text
    this.count += 1
    this.lines = [...this.lines.slice(1 - KEPT), { number: this.count, text: cut }]
  }

  clear(): void {
    this.lines = []
  }

  get(): readonly LogLine[] {
    return this.lines
  }
}

export function matching(lines: readonly LogLine[], search: string): readonly LogLine[] {
  const wanted = search.trim().toLowerCase()
  return wanted === '' ? lines : lines.filter((line) => line.text.toLowerCase().includes(wanted))
}
