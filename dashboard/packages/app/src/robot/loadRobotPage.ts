/**
 * Fetches the page of a robot, with every widget. Whoever only signs in doesn't wait for it; whoever looks at a list with robots
 * has it already when he chooses one.
 */
export const loadRobotPage = () => import('./RobotPage')
