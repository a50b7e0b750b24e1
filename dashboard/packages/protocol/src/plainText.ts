/**
 * Text that people chose, without what acts on a terminal or a page, as `mosaic_core.words.plain_text` reads it: a field
 * of a message passes here once, when it is read from the wire.
 */

/** They end a line or move along it. */
const BLANKS = /[\t-\r\u0085\u2028\u2029]/gu
/** They take no room: two names would look alike. */
const UNSEEN = /[\u200b\u2060\ufeff\u00ad]/gu
/** Orders to a terminal (ISO 6429), and what turns the text behind it round (UAX #9). */
// eslint-disable-next-line no-control-regex -- they are what is looked for
const ACTING = /[\u0000-\u001f\u007f-\u009f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]/gu

/** `text` on one line, no longer than before: blanks for ends of lines, `\ufffd` for what would act. */
export function plainText(text: string): string {
  return text.replace(BLANKS, ' ').replace(UNSEEN, '').replace(ACTING, '\ufffd')
}
