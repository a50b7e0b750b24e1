import { CloseButton, Dialog, Group } from '@mantine/core'
import { Component, type ComponentType, type ReactNode } from 'react'
import { fetched } from './fetched'

interface Closable {
  onClose: () => void
}

interface State {
  message: string | null
}

/** A dialog whose code comes when it is first opened. Where it can't come it says so, and the page under it stays. */
export function lazyDialog<P extends Closable>(load: () => Promise<{ default: ComponentType<P> }>): ComponentType<P> {
  const Fetched = fetched<P>(async () => (await load()).default)
  return function LazyDialog(props: P) {
    return (
      <DialogBoundary onClose={props.onClose}>
        <Fetched {...props} />
      </DialogBoundary>
    )
  }
}

/** Confines the failure of a dialog: nothing of the page goes with it, above all not the drive pad. */
class DialogBoundary extends Component<Closable & { children: ReactNode }, State> {
  override state: State = { message: null }

  static getDerivedStateFromError(error: unknown): State {
    return { message: error instanceof Error ? error.message : String(error) }
  }

  override render(): ReactNode {
    if (this.state.message === null) return this.props.children
    return (
      <Dialog opened onClose={this.props.onClose}>
        <Group wrap="nowrap" align="start">
          <span role="alert">This could not be opened. {this.state.message}</span>
          <CloseButton aria-label="Hide this" onClick={this.props.onClose} />
        </Group>
      </Dialog>
    )
  }
}
