/** Roles in words, and which accounts a search means. Pure. */
import type { Role, RoleOnRobot } from '@mosaic/client'

export const ROLES: readonly { role: Role; title: string; may: string }[] = [
  { role: 'observer', title: 'Observer', may: 'watches, and may stop the robot' },
  { role: 'operator', title: 'Operator', may: 'also drives' },
  { role: 'supervisor', title: 'Supervisor', may: 'also takes over with a reason, clears stops and reads the journal' },
]

/** Stands for “nothing granted” where roles are chosen. */
export const DEFAULT = 'default'
export type RoleChoice = Role | typeof DEFAULT

export function titleOf(role: Role): string {
  return ROLES.find((one) => one.role === role)?.title ?? role
}

/** The role that an account has where nothing was granted. */
export function defaultOf(account: Pick<RoleOnRobot, 'isOrganizationAdmin'>, organizationDefault: Role): Role {
  return account.isOrganizationAdmin ? 'supervisor' : organizationDefault
}

export function choiceOf({ isGranted, role }: Pick<RoleOnRobot, 'isGranted' | 'role'>): RoleChoice {
  return isGranted ? role : DEFAULT
}

/** `isRole(x) ? granted : default`. */
export function roleOfChoice(choice: string): Role | null {
  return ROLES.find(({ role }) => role === choice)?.role ?? null
}

export function foundAccounts(accounts: readonly RoleOnRobot[], search: string): RoleOnRobot[] {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean)
  return accounts.filter(({ email, fullName, role }) => {
    const text = `${fullName} ${email} ${role}`.toLowerCase()
    return words.every((word) => text.includes(word))
  })
}
