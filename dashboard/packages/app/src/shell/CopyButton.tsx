import { Button, Textarea, type ButtonProps } from '@mantine/core'
import { IconCheck, IconCopy } from '@tabler/icons-react'
import { useEffect, useRef, useState } from 'react'
import { copyText } from './copyText'

const COPIED_FOR_MS = 2000

export interface CopyButtonProps extends Pick<ButtonProps, 'size' | 'disabled'> {
  text: string
  children?: string
}

/** Copies a text; where the browser does not let it, shows it selected, to be copied by hand. */
export function CopyButton({ text, children = 'Copy', size, disabled }: CopyButtonProps) {
  const [state, setState] = useState<'idle' | 'copied' | 'refused'>('idle')
  const place = useRef<HTMLDivElement>(null)
  useEffect(() => {
    if (state !== 'copied') return undefined
    const timer = setTimeout(() => setState('idle'), COPIED_FOR_MS)
    return () => clearTimeout(timer)
  }, [state])
  const copy = async () => {
    if (place.current !== null) setState((await copyText(text, place.current)) ? 'copied' : 'refused')
  }
  const Icon = state === 'copied' ? IconCheck : IconCopy
  return (
    <div ref={place}>
      <Button {...(size !== undefined && { size })} variant="default" leftSection={<Icon size={16} aria-hidden />} disabled={disabled === true} onClick={() => void copy()}>
        {state === 'copied' ? 'Copied' : children}
      </Button>
      {state === 'refused' && (
        <Textarea
          label="This browser does not let the page copy: press Ctrl+C"
          value={text}
          readOnly
          autoFocus
          rows={4}
          mt="xs"
          onFocus={(event) => event.currentTarget.select()}
        />
      )}
    </div>
  )
}
