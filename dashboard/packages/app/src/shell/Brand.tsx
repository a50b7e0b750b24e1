import classes from './shell.module.css'

export function Brand() {
  return (
    <span className={classes.brand}>
      <svg viewBox="0 0 32 32" width={24} height={24} aria-hidden>
        <rect width="32" height="32" rx="7" fill="#1a66d2" />
        <g fill="#fff">
          <rect x="7" y="7" width="8" height="8" rx="2" />
          <rect x="17" y="7" width="8" height="8" rx="2" opacity=".6" />
          <rect x="7" y="17" width="8" height="8" rx="2" opacity=".6" />
          <rect x="17" y="17" width="8" height="8" rx="2" />
        </g>
      </svg>
      <span className={classes.word}>MOSAIC</span>
    </span>
  )
}
