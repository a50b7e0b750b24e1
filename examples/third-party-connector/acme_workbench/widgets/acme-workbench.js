import { useLatestJson as e } from "@mosaic/widgets";
import { useState as t } from "react";
import { jsx as n, jsxs as r } from "react/jsx-runtime";
// acme-workbench.tsx
var i = 1, a = 20, o = 100;
function s({ entry: i, store: s }) {
	let [c, l] = t(!1), u = e(s);
	if (u === null) return /* @__PURE__ */ n("p", {
		style: {
			margin: "auto",
			color: "var(--m-faint)"
		},
		children: "No reading yet"
	});
	let { temperature_c: d } = u, f = c ? `${(d * 9 / 5 + 32).toFixed(1)} °F` : `${d.toFixed(1)} °C`;
	return /* @__PURE__ */ r("div", {
		style: {
			margin: "auto",
			display: "flex",
			flexDirection: "column",
			gap: 12,
			alignItems: "center"
		},
		children: [
			/* @__PURE__ */ n("strong", {
				style: { fontSize: "2rem" },
				children: f
			}),
			/* @__PURE__ */ n("meter", {
				"aria-label": `Temperature of ${i.label}`,
				min: a,
				high: 80,
				max: o,
				value: d
			}),
			/* @__PURE__ */ r("button", {
				onClick: () => l(!c),
				children: ["in ", c ? "°C" : "°F"]
			})
		]
	});
}
export { s as ThermometerPanel, i as apiVersion };
