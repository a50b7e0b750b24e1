import { Alert, Button, Group, Text, Textarea } from '@mantine/core'
import type { DescribedConnector } from '@mosaic/client'
import { IconFileImport } from '@tabler/icons-react'
import { useRef, useState, type DragEvent } from 'react'
import { describedRows, travelText } from './description'
import classes from './describe.module.css'
import type { YamlConnectors } from './yamlConnectors'

/** No robot's file is larger; a picture dropped by mistake is. */
const MAX_BYTES = 1_000_000

export interface YamlImportProps {
  isBusy: boolean
  /** True once they are kept. */
  onAdd: (connectors: readonly DescribedConnector[]) => Promise<boolean>
}

/** The robot's own YAML file, pasted, dropped or chosen: every connector in it becomes an entry. */
export function YamlImport({ isBusy, onAdd }: YamlImportProps) {
  const [text, setText] = useState('')
  const [read, setRead] = useState<YamlConnectors | null>(null)
  const [isOver, setIsOver] = useState(false)
  const file = useRef<HTMLInputElement>(null)
  const look = async (next: string) => {
    setText(next)
    const { connectorsInYaml } = await import('./yamlConnectors')
    setRead(next.trim() === '' ? null : connectorsInYaml(next))
  }
  const lookInto = async (dropped: File | undefined) => {
    if (dropped === undefined) return
    if (dropped.size <= MAX_BYTES) await look(await dropped.text())
    else setRead({ connectors: [], problems: [{ line: 1, message: `‘${dropped.name}’ is too large for a robot’s file` }] })
  }
  const drop = (event: DragEvent) => {
    event.preventDefault()
    setIsOver(false)
    void lookInto(event.dataTransfer.files[0])
  }
  const add = async (connectors: readonly DescribedConnector[]) => {
    if (!(await onAdd(connectors))) return
    setText('')
    setRead(null)
  }
  return (
    <div
      className={classes.drop}
      data-over={isOver}
      onDragOver={(event) => {
        event.preventDefault()
        setIsOver(true)
      }}
      onDragLeave={() => setIsOver(false)}
      onDrop={drop}
    >
      <Textarea
        label="The robot’s YAML file"
        description="Paste it, or drop the file here. Only labels and types are taken; tokens and addresses stay in this browser."
        placeholder={'connectors:\n  - { type: ros2-receiver-geometry-Twist, label: cmd_vel }'}
        value={text}
        onChange={(event) => void look(event.currentTarget.value)}
        rows={6}
        resize="vertical"
        spellCheck={false}
        classNames={{ input: classes.code ?? '' }}
      />
      {read !== null && <Problems problems={read.problems} />}
      {read !== null && read.connectors.length > 0 && <Preview connectors={read.connectors} />}
      <Group justify="flex-end" gap="sm">
        <input
          ref={file}
          type="file"
          accept=".yaml,.yml,text/yaml"
          hidden
          onChange={(event) => {
            void lookInto(event.currentTarget.files?.[0])
            event.currentTarget.value = ''
          }}
        />
        <Button variant="default" leftSection={<IconFileImport size={16} />} onClick={() => file.current?.click()}>
          Choose a file
        </Button>
        <Button loading={isBusy} disabled={read === null || read.connectors.length === 0} onClick={() => read !== null && void add(read.connectors)}>
          {read === null || read.connectors.length === 0 ? 'Add its connectors' : `Add ${countText(read.connectors.length)}`}
        </Button>
      </Group>
    </div>
  )
}

function Problems({ problems }: { problems: YamlConnectors['problems'] }) {
  if (problems.length === 0) return null
  return (
    <Alert color="orange" role="alert" title="Not everything in it can be read" p="xs">
      <ul className={classes.problems}>
        {problems.map(({ line, message }, index) => (
          <li key={index}>
            line {line}: {message}
          </li>
        ))}
      </ul>
    </Alert>
  )
}

function Preview({ connectors }: { connectors: readonly DescribedConnector[] }) {
  return (
    <ul className={classes.preview} aria-label="Connectors in the file">
      {describedRows(connectors).map(({ label, connector, entry }) => (
        <li key={label}>
          <strong>{label}</strong>
          <Text span size="xs" c="dimmed">
            {connector.connectorType} · {travelText(entry)}
            {connector.dataType !== undefined && ' (by its name)'}
          </Text>
        </li>
      ))}
    </ul>
  )
}

function countText(count: number): string {
  return count === 1 ? '1 connector' : `${count} connectors`
}
