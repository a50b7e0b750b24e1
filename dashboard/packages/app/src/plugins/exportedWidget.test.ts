import { Component, memo } from 'react'
import { expect, test } from 'vitest'
import { exportedWidget, WIDGET_API_VERSION } from './exportedWidget'

const ArmPanel = () => null

test.each([ArmPanel, memo(ArmPanel), Component])('a component is taken: %o', (component) => {
  expect(exportedWidget({ apiVersion: WIDGET_API_VERSION, ArmPanel: component }, 'ArmPanel')).toBe(component)
})

test.each([
  [{ ArmPanel }, 'It must say `export const apiVersion = 1`.'],
  [{ apiVersion: 2, ArmPanel }, 'written for version 2 of the contract for widgets, this dashboard knows 1'],
  [{ apiVersion: '1', ArmPanel }, 'It must say'],
  [{ apiVersion: 1, ArmPannel: ArmPanel }, 'It exports no ‘ArmPanel’; did you mean ‘ArmPannel’?'],
  [{ apiVersion: 1 }, 'It exports no ‘ArmPanel’.'],
  [{ apiVersion: 1, ArmPanel: null }, 'What it exports as ‘ArmPanel’ is no component.'],
  [{ apiVersion: 1, ArmPanel: 'div' }, 'is no component'],
])('%o is refused in plain words', (module, words) => {
  expect(() => exportedWidget(module, 'ArmPanel')).toThrow(words)
})
