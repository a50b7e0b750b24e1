import { Alert, Badge, Loader, Modal, NativeSelect, Text, TextInput } from '@mantine/core'
import type { Role, RoleOnRobot } from '@mosaic/client'
import { IconAlertTriangle, IconSearch } from '@tabler/icons-react'
import { useState } from 'react'
import { choiceOf, DEFAULT, defaultOf, foundAccounts, roleOfChoice, ROLES, titleOf } from './grants'
import classes from './GrantsDialog.module.css'
import { useGrants } from './useGrants'

const ROLE_OPTIONS = ROLES.map(({ role, title }) => ({ value: role, label: title }))
/** A handful is found at a glance. */
const SEARCH_FROM = 8

export interface GrantsDialogProps {
  robotId: string
  name: string
  onClose: () => void
}

/** Who may watch, drive and supervise this robot; for the administrators of its organization. */
export default function GrantsDialog({ robotId, name, onClose }: GrantsDialogProps) {
  return (
    <Modal opened onClose={onClose} size="lg" title={`Roles on ${name}`}>
      <Grants robotId={robotId} />
    </Modal>
  )
}

function Grants({ robotId }: { robotId: string }) {
  const { accounts, organization, failure, changing, grant, setDefault } = useGrants(robotId)
  const [search, setSearch] = useState('')
  return (
    <div className={classes.root}>
      <ul className={classes.roles}>
        {ROLES.map(({ role, title, may }) => (
          <li key={role}>
            <strong>{title}</strong> {may}
          </li>
        ))}
      </ul>
      {failure !== null && (
        <Alert color="red" icon={<IconAlertTriangle size={18} />} title={failure.message} role="alert">
          {failure.cure}
        </Alert>
      )}
      {(accounts === null || organization === null) && failure === null && <Loader size="sm" mx="auto" />}
      {accounts !== null && organization !== null && (
        <>
          {accounts.length >= SEARCH_FROM && (
            <TextInput
              value={search}
              onChange={(event) => setSearch(event.currentTarget.value)}
              placeholder="Find an account"
              aria-label="Find an account"
              leftSection={<IconSearch size={16} aria-hidden />}
            />
          )}
          <ul className={classes.list} aria-label="Accounts">
            {foundAccounts(accounts, search).map((account) => (
              <Account
                key={account.accountId}
                account={account}
                defaultRole={defaultOf(account, organization.defaultRole)}
                isBusy={changing !== null}
                onChoose={(role) => void grant(account.accountId, role)}
              />
            ))}
          </ul>
          <div className={classes.default}>
            <Text size="sm">
              Where nothing was granted, on every robot of {organization.name}, accounts are
            </Text>
            <NativeSelect
              aria-label="Default role of the organization"
              data={ROLE_OPTIONS}
              value={organization.defaultRole}
              disabled={changing !== null}
              onChange={(event) => void setDefault(roleOfChoice(event.currentTarget.value) ?? organization.defaultRole)}
            />
          </div>
          <Text size="xs" c="dimmed">
            A changed role counts at once: connections of that account to this robot are closed and come back with the new one. Further
            accounts: <code>mosaic server user add EMAIL</code>.
          </Text>
        </>
      )}
    </div>
  )
}

interface AccountProps {
  account: RoleOnRobot
  defaultRole: Role
  isBusy: boolean
  onChoose: (role: Role | null) => void
}

function Account({ account, defaultRole, isBusy, onChoose }: AccountProps) {
  const { fullName, email, isActive, isProgram, isOrganizationAdmin } = account
  return (
    <li className={classes.account} data-active={isActive}>
      <span className={classes.who}>
        <strong>{fullName === '' ? email : fullName}</strong>
        {fullName !== '' && <span>{email}</span>}
        <span className={classes.badges}>
          {isOrganizationAdmin && <Badge variant="light">administrator</Badge>}
          {isProgram && <Badge variant="light" color="gray">program</Badge>}
          {!isActive && <Badge variant="light" color="orange">disabled</Badge>}
        </span>
      </span>
      <NativeSelect
        aria-label={`Role of ${fullName === '' ? email : fullName}`}
        data={[{ value: DEFAULT, label: `Default (${titleOf(defaultRole)})` }, ...ROLE_OPTIONS]}
        value={choiceOf(account)}
        disabled={isBusy}
        onChange={(event) => onChoose(roleOfChoice(event.currentTarget.value))}
      />
    </li>
  )
}
