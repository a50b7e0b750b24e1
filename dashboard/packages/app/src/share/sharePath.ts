/** Where a phone or laptop becomes a robot. */
export const SHARE_PATH = '/share'
