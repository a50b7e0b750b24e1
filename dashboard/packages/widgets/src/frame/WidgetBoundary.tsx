import { Button } from '@mantine/core'
import { Component, type ReactNode } from 'react'
import { Notice } from './Notice'

interface WidgetBoundaryProps {
  title: string
  children: ReactNode
}

interface WidgetBoundaryState {
  message: string | null
}

/** Confines the failure of a widget: nothing else of the page goes with it, above all not the drive pad. */
export class WidgetBoundary extends Component<WidgetBoundaryProps, WidgetBoundaryState> {
  override state: WidgetBoundaryState = { message: null }

  static getDerivedStateFromError(error: unknown): WidgetBoundaryState {
    return { message: error instanceof Error ? error.message : String(error) }
  }

  override render(): ReactNode {
    if (this.state.message === null) return this.props.children
    return (
      <Notice tone="bad" title={`${this.props.title} failed`}>
        {this.state.message}{' '}
        <Button size="compact-xs" variant="default" onClick={() => this.setState({ message: null })}>
          Try again
        </Button>
      </Notice>
    )
  }
}
