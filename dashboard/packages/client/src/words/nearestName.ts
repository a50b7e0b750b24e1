/** The known name that was perhaps meant, as `did you mean` shows it; null where none is near. */
export function nearestName(name: string, known: readonly string[]): string | null {
  let best: string | null = null
  let bestDistance = Math.max(2, Math.floor(name.length / 3)) + 1
  for (const candidate of known) {
    const distance = editDistance(folded(name), folded(candidate))
    if (distance < bestDistance) [best, bestDistance] = [candidate, distance]
  }
  return best
}

// Spelling that people mix up counts as the same.
function folded(name: string): string {
  return name.toLowerCase().replace(/[-_. ]/g, '_')
}

/** Optimal string alignment: insertions, deletions, replacements and swaps of neighbours. */
export function editDistance(a: string, b: string): number {
  const rows: number[][] = [Array.from({ length: b.length + 1 }, (_, column) => column)]
  for (let i = 1; i <= a.length; i += 1) {
    const row = [i]
    for (let j = 1; j <= b.length; j += 1) row.push(cell(a, b, i, j, rows, row))
    rows.push(row)
  }
  return at(rows[a.length], b.length)
}

function cell(a: string, b: string, i: number, j: number, rows: number[][], row: number[]): number {
  const above = rows[i - 1]
  const cost = a[i - 1] === b[j - 1] ? 0 : 1
  const plain = Math.min(at(above, j) + 1, at(row, j - 1) + 1, at(above, j - 1) + cost)
  const isSwap = i > 1 && j > 1 && a[i - 1] === b[j - 2] && a[i - 2] === b[j - 1]
  return isSwap ? Math.min(plain, at(rows[i - 2], j - 2) + 1) : plain
}

function at(row: number[] | undefined, index: number): number {
  return row?.[index] ?? 0
}
