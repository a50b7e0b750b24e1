/**
 * Text that people chose, without what acts on a terminal or a page, as `mosaic_core.words.plain_text` reads it: a field
 * of a message passes here once, when it is read from the wire.
 */

/** They end a line or move along it. */
const BLANKS = /[\t-\r\u0085\u2028\u2029]/gu
/**
 * They take no room (Default_Ignorable_Code_Point, UAX #44): two names would look alike, or carry more than is seen. Left
 * are the joiners U+200C and U+200D and the selectors U+FE0E and U+FE0F: Persian, Hindi and emoji need them.
 */
const UNSEEN =
  // eslint-disable-next-line no-misleading-character-class -- they stand alone, though some combine in a text
  /[\u00ad\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u200b\u2060-\u2065\u206a-\u206f\u3164\ufe00-\ufe0d\ufeff\uffa0\ufff0-\ufff8\u{1bca0}-\u{1bca3}\u{1d173}-\u{1d17a}\u{e0000}-\u{e0fff}]/gu
/** Orders to a terminal (ISO 6429), and what turns the text behind it round (UAX #9). */
// eslint-disable-next-line no-control-regex -- they are what is looked for
const ACTING = /[\u0000-\u001f\u007f-\u009f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]/gu

/** `text` on one line, no longer than before: blanks for ends of lines, `\ufffd` for what would act. */
export function plainText(text: string): string {
  return text.replace(BLANKS, ' ').replace(UNSEEN, '').replace(ACTING, '\ufffd')
}
