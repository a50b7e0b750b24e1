/** The round step (1, 2 or 5 times a power of ten) that splits `span` into at most `parts`. */
export function niceStep(span: number, parts: number): number {
  const raw = span / Math.max(1, parts)
  if (!(raw > 0) || !Number.isFinite(raw)) return 1
  const power = 10 ** Math.floor(Math.log10(raw))
  const factor = [1, 2, 5, 10].find((candidate) => candidate * power >= raw * (1 - 1e-9)) ?? 10
  return factor * power
}
