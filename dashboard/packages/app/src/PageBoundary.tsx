import { Button, Center, Stack } from '@mantine/core'
import { Component, type ReactNode } from 'react'
import { FailureAlert } from './session/FailureAlert'

const FAILURE = {
  code: '',
  message: 'This page could not be shown',
  cure: 'The server may be away, or newer than the page that is open here: reload it.',
}

/** Says that a page can't be shown where nothing would be seen: mostly its script could not be fetched any more. */
export class PageBoundary extends Component<{ children: ReactNode }, { hasFailed: boolean }> {
  override state = { hasFailed: false }

  static getDerivedStateFromError(): { hasFailed: boolean } {
    return { hasFailed: true }
  }

  override render(): ReactNode {
    if (!this.state.hasFailed) return this.props.children
    return (
      <Center h="100dvh" p="md">
        <Stack maw={480}>
          <FailureAlert failure={FAILURE} />
          <Button onClick={() => location.reload()}>Reload</Button>
        </Stack>
      </Center>
    )
  }
}
