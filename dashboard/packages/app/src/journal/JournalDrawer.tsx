import { Alert, Button, Drawer, Group, SegmentedControl, TextInput } from '@mantine/core'
import type { JournalEntry } from '@mosaic/client'
import { useControl } from '@mosaic/react'
import { download, fileName } from '@mosaic/widgets'
import { IconAlertTriangle, IconDownload, IconSearch } from '@tabler/icons-react'
import { Fragment, useState } from 'react'
import classes from './JournalDrawer.module.css'
import { about, dayOf, explained, found, timeOf, toneOf, whatText, type JournalTopic } from './journalEntries'
import { useJournal } from './useJournal'

const TOPICS: { value: JournalTopic; label: string }[] = [
  { value: 'everything', label: 'Everything' },
  { value: 'control', label: 'Control and stops' },
  { value: 'refusals', label: 'Refusals' },
]

export interface JournalDrawerProps {
  robotId: string
  name: string
  onClose: () => void
}

/** Who did what with the robot, newest first, as the robot wrote it down. Supervisors only. */
export default function JournalDrawer({ robotId, name, onClose }: JournalDrawerProps) {
  return (
    // No veil over the page: a supervisor reads this while somebody drives.
    <Drawer
      opened
      onClose={onClose}
      position="right"
      size="lg"
      title={`Journal of ${name}`}
      withOverlay={false}
      lockScroll={false}
      trapFocus={false}
      classNames={{ inner: classes.inner }}
    >
      <Journal robotId={robotId} name={name} />
    </Drawer>
  )
}

function Journal({ robotId, name }: { robotId: string; name: string }) {
  const { desk } = useControl(robotId)
  const { entries, failure, isLoading, hasOlder, readOlder } = useJournal(desk)
  const [search, setSearch] = useState('')
  const [topic, setTopic] = useState<JournalTopic>('everything')
  const shown = found(about(entries, topic), search)
  return (
    <div className={classes.root}>
      <Group gap="sm" wrap="nowrap">
        <TextInput
          className={classes.search}
          value={search}
          onChange={(event) => setSearch(event.currentTarget.value)}
          placeholder="Filter: a name, “refused”, “stop” …"
          aria-label="Filter the journal"
          leftSection={<IconSearch size={16} aria-hidden />}
        />
        <Button variant="default" leftSection={<IconDownload size={16} aria-hidden />} disabled={shown.length === 0} onClick={() => exportJson(name, shown)}>
          Export
        </Button>
      </Group>
      <SegmentedControl
        aria-label="What to show"
        data={TOPICS}
        value={topic}
        onChange={setTopic}
      />
      {failure !== null && (
        <Alert color="red" icon={<IconAlertTriangle size={18} />} title={failure.message} role="alert">
          {failure.cure}
        </Alert>
      )}
      <Entries entries={shown} />
      {shown.length === 0 && !isLoading && failure === null && <p className={classes.none}>{entries.length === 0 ? 'Nothing has happened yet.' : 'No entry fits the filter.'}</p>}
      {hasOlder && entries.length > 0 && (
        <Button variant="default" loading={isLoading} onClick={() => void readOlder()}>
          Older entries
        </Button>
      )}
    </div>
  )
}

function Entries({ entries }: { entries: readonly JournalEntry[] }) {
  return (
    <ol className={classes.list} aria-label="Journal, newest first">
      {entries.map((entry, index) => (
        <Fragment key={entry.number}>
          {dayOf(entry.at) !== dayOf(entries[index - 1]?.at ?? '') && <li className={classes.day}>{dayOf(entry.at)}</li>}
          <Entry entry={entry} />
        </Fragment>
      ))}
    </ol>
  )
}

function Entry({ entry }: { entry: JournalEntry }) {
  const { at, what, who, account, subject, code, message } = entry
  const why = [explained(entry), message].filter((part) => part !== '')
  return (
    <li className={classes.entry} data-tone={toneOf(entry)}>
      <time dateTime={at} title={at}>
        {timeOf(at)}
      </time>
      <span>
        <strong>{whatText(what)}</strong> {subject !== '' && <code>{subject}</code>}{' '}
        <span title={account === undefined ? undefined : `Account ${account}`}>{who}</span>
        {why.length > 0 && (
          <span className={classes.why}>
            {why.join(' ')} {code !== '' && <code>{code}</code>}
          </span>
        )}
      </span>
    </li>
  )
}

function exportJson(name: string, entries: readonly JournalEntry[]): void {
  const newest = entries[0]?.at ?? ''
  download(fileName('journal', name, newest) + '.json', new Blob([JSON.stringify(entries, null, 2)], { type: 'application/json' }))
}
