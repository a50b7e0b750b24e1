import { ActionIcon, Alert, Button, Text, Title } from '@mantine/core'
import type { RobotSummary } from '@mosaic/client'
import { IconTrash } from '@tabler/icons-react'
import { ConnectorForm } from './ConnectorForm'
import { describedRows, travelText } from './description'
import classes from './describe.module.css'
import { useDescription, type Description } from './useDescription'
import { useFound } from './useFound'
import { YamlImport } from './YamlImport'

/** What a robot has that announces nothing: read from its file, found, or said by hand; kept on the server for everybody. */
export function DescribeRobot({ robot }: { robot: RobotSummary }) {
  const description = useDescription(robot)
  const { mayDescribe, failure, isBusy, add } = description
  return (
    <div className={classes.panel}>
      {failure !== null && (
        <Alert color="red" role="alert" title={failure.message}>
          {failure.cure}
        </Alert>
      )}
      {!mayDescribe && (
        <Text size="sm" role="note">
          Your role is observer: you see what others described, and can’t change it.
        </Text>
      )}
      <Described description={description} />
      {mayDescribe && (
        <>
          <Section title="From its file">
            <YamlImport isBusy={isBusy} onAdd={add} />
          </Section>
          <FoundList robotId={robot.id} description={description} />
          <Section title="By hand">
            <ConnectorForm robotId={robot.id} isBusy={isBusy} onAdd={(connector) => add([connector])} />
          </Section>
        </>
      )}
    </div>
  )
}

function Section({ title, children }: { title: string; children: React.ReactNode }) {
  return (
    <section className={classes.section} aria-label={title}>
      <Title order={3} size="h5">
        {title}
      </Title>
      {children}
    </section>
  )
}

function Described({ description: { connectors, mayDescribe, isBusy, remove } }: { description: Description }) {
  const rows = describedRows(connectors)
  if (rows.length === 0) return null
  return (
    <Section title="Described so far">
      <ul className={classes.rows} aria-label="Described connectors">
        {rows.map(({ label, connector, entry }) => (
          <li key={label} className={classes.row}>
            <span className={classes.names}>
              <strong>{label}</strong>
              <small>{[connector.connectorType, travelText(entry)].filter(Boolean).join(' · ')}</small>
            </span>
            {mayDescribe && (
              <ActionIcon variant="subtle" color="gray" size="lg" disabled={isBusy} aria-label={`Forget ${label}`} onClick={() => void remove(label)}>
                <IconTrash size={17} stroke={1.6} />
              </ActionIcon>
            )}
          </li>
        ))}
      </ul>
    </Section>
  )
}

function FoundList({ robotId, description: { connectors, isBusy, add } }: { robotId: string; description: Description }) {
  const found = useFound(robotId, connectors)
  if (found.length === 0) return null
  return (
    <Section title="Found">
      <ul className={classes.rows} aria-label="Found connectors">
        {found.map(({ label, connectors: those, source }) => (
          <li key={label} className={classes.row}>
            <span className={classes.names}>
              <strong>{label}</strong>
              <small>{source}</small>
            </span>
            <Button size="compact-sm" variant="default" disabled={isBusy} aria-label={`Add ${label}`} onClick={() => void add(those)}>
              Add
            </Button>
          </li>
        ))}
      </ul>
      {found.length > 1 && (
        <Button size="compact-sm" variant="subtle" disabled={isBusy} onClick={() => void add(found.flatMap((one) => one.connectors))}>
          Add all of them
        </Button>
      )}
    </Section>
  )
}
