/** Counts what one store has received and sent since it was made, over all its channels and connections. */
export class StoreCounters {
  /** Messages that came. */
  received = 0
  /** Bytes of messages that came. */
  receivedBytes = 0
  /** Numbers that were skipped: lost on the way, or replaced by a newer value before they left the robot. */
  missed = 0
  /** Came after a newer one. */
  late = 0
  /** Large messages of which only parts arrived. */
  incomplete = 0
  /** Messages that left. */
  sent = 0
  /** Bytes of messages that left. */
  sentBytes = 0
  /** Accepted, but a newer value took their place before they left. */
  replaced = 0
  /** Not accepted although nobody else commands: not open, or too much was waiting. */
  refused = 0

  /** Called by the connection: a message came. */
  got(bytes: number): void {
    this.received += 1
    this.receivedBytes += bytes
  }

  /** Called by the connection: a message left. */
  gave(bytes: number): void {
    this.sent += 1
    this.sentBytes += bytes
  }
}
