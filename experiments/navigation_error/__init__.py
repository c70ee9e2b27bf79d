"""What a drift costs a navigator at rest: closed form, integration, before and after a model."""
